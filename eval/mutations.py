"""Would the tests notice? Lines that carry the meaning are written wrong, one after the other.

    python eval/mutations.py
    python eval/mutations.py --only DDIM margins

Each mutant of `parts/mutants.py` is a copy of the repository with one change in one place. It is
killed if one of the tests that are named beside it fails, while all of them pass without the
change. A mutant that survives is a line that no test holds.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from parts.mutants import MUTANTS, Mutant
from tqdm import tqdm

from jaxplan.cli import run_script
from jaxplan.evaluation.result import write_result
from jaxplan.ranges import Checked, Count

ROOT = Path(__file__).resolve().parents[1]
COPIED = (
    "jaxplan",
    "tests",
    "train",
    "eval",
    "configs",
    "docs",
    "pyproject.toml",
    "README.md",
)


@dataclass(frozen=True)
class Args(Checked):
    """Makes the changes, runs the tests, prints what survives."""

    only: tuple[str, ...] = ()
    """Words in the names of mutants; all by default."""
    limit: Count = 900
    """Of one run of tests [s]; a mutant for ever busy is killed."""
    out: Path = Path("runs/mutations.json")


@dataclass
class Row:
    """What became of a mutant."""

    name: str
    file: str
    killed: bool
    by: str
    """The first test that failed, or why there was none."""
    seconds: float


def main(args: Args) -> None:
    """Runs, prints, writes JSON; exit code 1 where a mutant survives."""
    chosen = [
        m for m in MUTANTS if not args.only or any(w in m.name for w in args.only)
    ]
    if not chosen:
        raise ValueError(f"no mutant has {' or '.join(args.only)} in its name")
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place)
        for name in COPIED:
            source = ROOT / name
            (shutil.copytree if source.is_dir() else shutil.copy)(source, copy / name)
        sound: dict[str, str] = {}
        for mutant in tqdm(chosen, unit="mutant"):
            if mutant.tests not in sound:
                sound[mutant.tests] = failing(copy, mutant.tests, args.limit)
            if fails := sound[mutant.tests]:
                raise ValueError(f"without any change {fails} fails")
            rows.append(judged(copy, mutant, args.limit))
            write_result(args.out, {"mutants": [asdict(row) for row in rows]})
    for row in rows:
        print(f"{'killed' if row.killed else 'SURVIVES':9}{row.name}: {row.by}")
    survivors = sum(not row.killed for row in rows)
    print(f"{len(rows) - survivors} of {len(rows)} killed; written to {args.out}")
    sys.exit(survivors > 0)


def judged(copy: Path, mutant: Mutant, limit: int) -> Row:
    """Changes the copy, tests it, and changes it back."""
    path, began = copy / "jaxplan" / mutant.file, time.perf_counter()
    text = path.read_text()
    if text.count(mutant.old) != 1:
        found = f"{text.count(mutant.old)} times in {mutant.file}"
        raise ValueError(f"{mutant.name}: {json.dumps(mutant.old)} is {found}")
    path.write_text(text.replace(mutant.old, mutant.new))
    try:
        by = failing(copy, mutant.tests, limit)
    finally:
        path.write_text(text)
    seconds = time.perf_counter() - began
    return Row(mutant.name, mutant.file, bool(by), by or "no test failed", seconds)


def failing(copy: Path, tests: str, limit: int) -> str:
    """The first of some tests that fails in a copy; empty where all pass."""
    files = [f"tests/{name}" for name in tests.split()]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    environment = os.environ | {"PYTHONPATH": str(copy)}
    try:
        done = subprocess.run(
            [*command, "--no-header", "--tb=no", "-rfE", *files],
            cwd=copy,
            env=environment,
            capture_output=True,
            text=True,
            timeout=limit,
        )
    except subprocess.TimeoutExpired:
        return f"no end after {limit} s"
    if done.returncode == 0:
        return ""
    lines = done.stdout.splitlines()
    said = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    return said[0].split(" - ")[0] if said else (lines or [done.stderr])[-1]


if __name__ == "__main__":
    run_script(main, Args)
