"""Compilation: of a fresh process, of one with a persistent cache, and never again."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tqdm import tqdm

from jaxplan.evaluation.motion_bench import read_problems, read_robot
from parts.rows import Part, Ratio, Row, row_of

PART = "compile"
SCENE = "table_pick in slots"
COLD, CACHED = "cold", "persistent cache"
LEAST = 0.5
MOVED = f"{PART}, {SCENE}: traces and compilations when obstacles move"


def measure(quick: bool, data: Path) -> Part:
    """Fresh processes; a row that says so where the data are absent."""
    try:
        read_robot(data)
        read_problems(data)
    except FileNotFoundError as error:
        note = Row(PART, "Panda as spheres", "all sides", note=str(error))
        return Part([note], {}, {})
    found: dict[str, list[dict]] = {COLD: [], CACHED: []}
    with tempfile.TemporaryDirectory() as cache:
        filled = {"JAX_COMPILATION_CACHE_DIR": cache}
        if not quick:
            start(data, filled)
        for _ in tqdm(range(1 if quick else 3), desc=PART, unit="round"):
            # In a quick run the cold process is the one that fills the cache.
            found[COLD].append(start(data, filled if quick else {}))
            found[CACHED].append(start(data, filled))
    rows, ratios = [], {}
    for what in ("checker", "planner"):
        medians = {}
        for side, runs in found.items():
            again = [run[f"{what} again"] for run in runs]
            name = f"jaxplan {what}, {side}"
            row = row_of(
                PART, SCENE, name, "s", [run[what] for run in runs], again=min(again)
            )
            rows.append(row)
            medians[side] = row.median
        name = f"{PART}, {SCENE}: {what}, {COLD} / {CACHED}"
        ratios[name] = Ratio(medians[COLD] / medians[CACHED], LEAST, CACHED)
    moved = max(run["recompilations"] for runs in found.values() for run in runs)
    return Part(rows, ratios, {MOVED: moved})


def start(data: Path, variables: dict[str, str]) -> dict:
    """What `cold_start.py` says, with these environment variables and no other cache."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith("JAX_COMPILATION")}
    script = Path(__file__).parents[1] / "cold_start.py"
    done = subprocess.run(
        [sys.executable, str(script), str(data)],
        env=kept | variables,
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(f"{script.name}: {done.stderr.strip().splitlines()[-1]}")
    return json.loads(done.stdout.splitlines()[-1])
