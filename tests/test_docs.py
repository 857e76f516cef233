"""What the documents say runs: their Python blocks, in order."""

import importlib.util
import json
import re
import shlex
from pathlib import Path

import pytest

import jaxplan
from jaxplan import cli, train
from jaxplan.cells import Cell

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize(
    ("document", "directory"),
    [
        ("README.md", "."),
        ("docs/index.md", "docs"),
        pytest.param("docs/tutorial.md", "docs", marks=pytest.mark.long),
    ],
)
def test_python_blocks_run(document, directory, monkeypatch):
    monkeypatch.chdir(ROOT / directory)
    text = (ROOT / document).read_text(encoding="utf-8")
    names = {"__name__": document}
    blocks = list(re.finditer(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL))
    assert blocks
    for block in blocks:
        # Empty lines before the block, so that a traceback has the document's numbers.
        before = "\n" * (text[: block.start()].count("\n") + 1)
        exec(compile(before + block[1], document, "exec"), names)


@pytest.mark.long
def test_the_commands_for_a_sampler_of_ones_own_run(monkeypatch, tmp_path):
    """docs/sampler.md, in its order, at a small size; and what it says of the JSON is true."""
    text = (ROOT / "docs/sampler.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    ran = []
    for block in re.findall(r"^```bash\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        for line in block.splitlines():
            small = re.sub(r"--count \d+", "--count 24 --ways 1 --expansions 100", line)
            words = shlex.split(small)
            if words[0] == "jaxplan":
                assert cli.main(words[1:]) == 0, line
            else:
                assert words[:3] == ["python", "-m", "jaxplan.train"]
                assert (
                    train.main([*words[3:], "--steps", "10", "--batch-size", "8"]) == 0
                )
            ran.append(words[0])
    assert ran == ["jaxplan", "python", "python", "jaxplan"]
    sampler = jaxplan.load_sampler("weights/cell")
    scene = jaxplan.Scene.from_mjcf("docs/arm.xml", slots=sampler.scene["slots"])
    planner = jaxplan.Planner(scene, sampler=sampler)
    for given in re.findall(r"^```json\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        assert Cell(planner, json.loads(given)).draw(0, 1)


def test_the_results_page_is_results_md(tmp_path):
    spec = importlib.util.spec_from_file_location(
        "results", ROOT / "docs" / "results.py"
    )
    assert spec is not None
    assert spec.loader is not None
    results = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(results)
    results.RESULTS = tmp_path / "RESULTS.md"
    results.RESULTS.write_text("# Results\n\n| a |\n\n![b](docs/figures/b.png)\n")
    assert results.on_page_markdown("no mark") == "no mark"
    page = results.on_page_markdown("# Page\n\n{{ results }}\n")
    assert page == "# Page\n\n\n| a |\n\n![b](figures/b.png)\n\n"
