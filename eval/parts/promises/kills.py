"""R6 to R8: `kill -9` at a random moment, then the same command again."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from jaxplan.data import sha256
from parts.promises.promise import Promise, Trial

ROOT = Path(__file__).resolve().parents[3]


def _killed(
    command: Sequence[object], made: str, prepare: Sequence[object] = ()
) -> Callable[[Path], Trial]:
    """Files that match `made` are those of a run that nobody killed.

    Args:
        command: Run in a directory of its own.
        made: Pattern of the files that it makes, from there.
        prepare: A command that is run once before, in the directory above.
    """

    def made_in(directory: Path) -> dict[str, str]:
        return {
            str(path.relative_to(directory)): sha256(path)
            for path in sorted(directory.glob(made))
            if path.is_file()
        }

    def run(words: Sequence[object], directory: Path) -> subprocess.Popen:
        directory.mkdir(exist_ok=True)
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        return subprocess.Popen(
            [sys.executable, *map(str, words)],
            cwd=directory,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def begin(place: Path) -> Trial:
        if prepare and run(prepare, place).wait():
            raise RuntimeError(f"{' '.join(map(str, prepare))} failed")
        seconds = 0.0
        for name in ("cold", "whole"):  # the second finds its programs compiled
            start = time.monotonic()
            if run(command, place / name).wait():
                raise RuntimeError(f"{' '.join(map(str, command))} failed")
            seconds = time.monotonic() - start
        expected = made_in(place / "whole")
        if not expected:
            raise RuntimeError(f"no {made} made")

        def one(number: int) -> str | None:
            directory = place / str(number)
            process = run(command, directory)
            moment = np.random.default_rng(number).uniform(0, seconds)
            try:
                process.wait(moment)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            code = run(command, directory).wait()
            found = made_in(directory)
            if code or found != expected:
                differ = [n for n in expected if found.get(n) != expected[n]]
                said = f"exit code {code}" if code else f"other {', '.join(differ)}"
                return f"killed after {moment:.2f} of {seconds:.2f} s: {said}"
            return None

        return lambda numbers: [fault for n in numbers if (fault := one(n))]

    return begin


COLLECT = (
    ROOT / "train" / "collect_demos.py",
    *("--episodes", 4, "--shard-size", 2, "--workers", 1),
    *("--demonstration.perturbed-first", 1, "--demonstration.perturbed", 1),
)
TRAIN = ("-m", "jaxplan.train", "predictor", "--config", ROOT / "configs" / "debug.py")
RECORD = ("-m", "jaxplan.cli", "record", ROOT / "docs" / "arm.xml")
SCRIPT = (ROOT / "eval" / "expansions.py", "--quick", "--seeds", "300000:300004")

PROMISES = (
    Promise(
        "R6",
        "weights that differ after a training was killed",
        100,
        10,
        _killed(
            (*TRAIN, "--data", "../demos", "--steps", 40),
            "runs/debug_predictor/weights/*.npz",
            (*COLLECT, "--out", "demos"),
        ),
    ),
    Promise(
        "R7",
        "demonstrations that differ after collecting was killed",
        50,
        5,
        _killed((*COLLECT, "--out", "demos"), "demos/*"),
        "LeRobot: unreadable (#3522)",
    ),
    Promise(
        "R7c",
        "a cell's paths that differ after recording was killed",
        50,
        10,
        _killed((*RECORD, "--count", 256, "--ways", 1, "--out", "cell"), "cell/*"),
    ),
    Promise(
        "R8",
        "a table that differs after a study was killed",
        50,
        5,
        _killed(SCRIPT, "runs/pieces/*.json"),
    ),
)
