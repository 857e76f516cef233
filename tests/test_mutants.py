"""Mutants (`eval/mutations.py`) stay mutants of the code as it is."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "eval"))

from parts.mutants import MUTANTS

ROOT = Path(__file__).parents[1]


def test_each_mutant_changes_one_place_and_names_tests_that_there_are():
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS) >= 40
    for mutant in MUTANTS:
        text = (ROOT / "jaxplan" / mutant.file).read_text()
        assert text.count(mutant.old) == 1, mutant.name
        changed = text.replace(mutant.old, mutant.new)
        assert changed != text
        compile(changed, mutant.file, "exec")
        for name in mutant.tests.split():
            file, _, test = name.partition("::")
            assert f"def {test}" in (ROOT / "tests" / file).read_text(), mutant.name
