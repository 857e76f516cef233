"""R3, R9, R12, R14 to R17: bad input, mutated files, a full disk, what a machine may lack."""

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from parts.promises.promise import Promise, Trial

ROOT = Path(__file__).resolve().parents[3]
DOCS = ROOT / "docs"
BAD_INPUT = 2
SECONDS = 120.0
"""A command that takes longer hangs."""
ANSWERS = {0, 1, BAD_INPUT}
"""Exit codes: yes, no, bad input."""
NUMBERS = ("nan", "inf", "-inf", "1e400", "-1", "0", "1e30", "abc", "", "1,2", "None")


def _run(
    words: Sequence[object], place: Path, **environment: str
) -> tuple[int, str, str]:
    """Exit code, what is printed, and what is said of errors; 124 if it hangs."""
    known = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    try:
        done = subprocess.run(
            [sys.executable, *map(str, words)],
            cwd=place,
            env=known,
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=False,
            errors="replace",
        )
    except subprocess.TimeoutExpired:
        return 124, "", "hangs"
    return done.returncode, done.stdout, done.stderr


def _wrong(code: int, said: str) -> str | None:
    """What is wrong with how a command ended."""
    if code not in ANSWERS or "Traceback" in said:
        return f"exit code {code}: {said.strip()[-300:]}"
    if code == BAD_INPUT and not said.strip():
        return "exit code 2 without a word"
    return None


def _commands(place: Path) -> Trial:
    """Commands with a word that makes no sense: none may say that all is well."""
    arm, free = DOCS / "arm.xml", ("--start", "left", "--goal", "right")
    good: tuple[tuple[object, ...], ...] = (
        ("plan", arm, *free, "--seed", 0, "--velocity", 1, "--acceleration", 1),
        ("plan", arm, *free, "--joints", "turn,lift", "--hand", "hand"),
        ("plan", arm, *free, "--obstacles", DOCS / "obstacles.json"),
        ("plan", arm, *free, "--time-limit", 1, "--out", "out"),
        ("check", arm, "--at", "home", "--joints", "turn,lift", "--hand", "hand"),
        ("record", arm, "--out", "out", "--count", 2, "--ways", 1, "--seed", 0),
        ("record", arm, "--out", "out", "--problems", DOCS / "cell.json"),
        ("solve", "--seed", 0, "--variant", "plain", "--weights", "none"),
    )
    worse = (
        *NUMBERS,
        "/dev/null",
        "/nonexistent/x",
        "{}",
        "[]",
        "../..",
        "ü",
        "9" * 40,
    )

    def one(number: int) -> str | None:
        rng = np.random.default_rng(number)
        words = list(good[rng.integers(len(good))])
        at = int(rng.integers(1, len(words)))
        words[at] = worse[rng.integers(len(worse))]
        with tempfile.TemporaryDirectory(dir=place) as empty:
            code, _, said = _run(["-m", "jaxplan.cli", *words], Path(empty))
        if fault := _wrong(code, said):
            return f"{' '.join(map(str, words))}: {fault}"
        return None

    return lambda numbers: [fault for n in numbers if (fault := one(n))]


def _mutate(text: str, rng: np.random.Generator) -> str:
    """A line or a word dropped, doubled or moved, a number that is none, bytes of anything."""
    kind = rng.integers(6)
    if kind < 3:
        lines = text.splitlines()
        at = int(rng.integers(len(lines)))
        new = {0: [], 1: [lines[at]] * 2, 2: [lines[int(rng.integers(len(lines)))]]}
        return "\n".join([*lines[:at], *new[int(kind)], *lines[at + 1 :]])
    if kind < 5:
        numbers = list(re.finditer(r"-?\d+\.?\d*", text))
        found = numbers[rng.integers(len(numbers))]
        odd = NUMBERS[rng.integers(len(NUMBERS))]
        return text[: found.start()] + odd + text[found.end() :]
    at, size = int(rng.integers(len(text))), int(rng.integers(1, 20))
    noise = "".join(map(chr, rng.integers(1, 0x250, size)))
    return text[:at] + noise + text[at + int(rng.integers(size)) :]


def _files(place: Path) -> Trial:
    """Models, descriptions and configs with something wrong in them."""
    ask = ("--start", "left", "--goal", "right", "--time-limit", 5)
    cases: tuple[tuple[Path, Callable[[Path], tuple[object, ...]]], ...] = (
        (DOCS / "arm.xml", lambda f: ("-m", "jaxplan.cli", "check", f)),
        (DOCS / "arm.xml", lambda f: ("-m", "jaxplan.cli", "plan", f, *ask)),
        (
            DOCS / "obstacles.json",
            lambda f: (
                *("-m", "jaxplan.cli", "plan", DOCS / "arm.xml", *ask),
                *("--obstacles", f),
            ),
        ),
        (
            DOCS / "cell.json",
            lambda f: (
                *("-m", "jaxplan.cli", "record", DOCS / "arm.xml", "--out", "cell"),
                *("--problems", f, "--count", 2, "--ways", 1, "--expansions", 500),
            ),
        ),
        (
            ROOT / "configs" / "debug.py",
            lambda f: (
                *("-m", "jaxplan.train", "predictor", "--config", f),
                *("--data", "nothing"),
            ),
        ),
    )

    def one(number: int) -> str | None:
        rng = np.random.default_rng(number)
        original, command = cases[number % len(cases)]
        with tempfile.TemporaryDirectory(dir=place) as empty:
            file = Path(empty) / original.name
            text = original.read_text(encoding="utf-8")
            for _ in range(rng.integers(1, 4)):
                text = _mutate(text, rng)
            file.write_text(text, encoding="utf-8")
            code, _, said = _run(command(file), Path(empty))
        if fault := _wrong(code, said):
            return f"{original.name}, {number}: {fault}"
        return None

    return lambda numbers: [fault for n in numbers if (fault := one(n))]


def _without(place: Path) -> Trial:
    """Planning without GL, a home, a display or ffmpeg; pictures say what is missing."""
    words = ("-m", "jaxplan.cli", "plan", DOCS / "arm.xml")
    words = (*words, "--start", "left", "--goal", "right", "--out", "out")
    python = str(Path(sys.executable).parent)
    missing = (
        ({"MUJOCO_GL": "disable"}, 0),
        ({"HOME": "/nonexistent", "XDG_CACHE_HOME": ""}, 0),
        ({"PATH": python, "DISPLAY": ""}, 0),
        ({"http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}, 0),
        ({"MUJOCO_GL": "disable", "VIDEO": "1"}, BAD_INPUT),
    )

    def one(number: int) -> str | None:
        environment, expected = missing[number]
        video = ["--video"] if "VIDEO" in environment else []
        with tempfile.TemporaryDirectory(dir=place) as empty:
            code, _, said = _run([*words, *video], Path(empty), **environment)
        if code != expected or "Traceback" in said:
            return f"{environment}: exit code {code}: {said.strip()[-300:]}"
        return None

    return lambda numbers: [fault for n in numbers if (fault := one(n))]


def _tests(*chosen: str) -> Callable[[Path], Trial]:
    """Tests of the suite, that hold the promise already."""

    def prepare(place: Path) -> Trial:
        def trial(numbers: range) -> list[str]:
            command = [sys.executable, "-m", "pytest", "-q", "-m", "not gpu", *chosen]
            done = subprocess.run(
                command, cwd=ROOT, capture_output=True, text=True, check=False
            )
            return [] if done.returncode == 0 else [done.stdout.strip()[-300:]]

        return trial

    return prepare


PROMISES = (
    Promise(
        "R3",
        "a bad problem (NaN, limits, contact, shapes, types) that is solved, or a traceback",
        1,
        1,
        _tests("tests/test_planner.py::test_nothing_bad_is_ever_solved"),
        "OMPL: NaN is an exact solution",
    ),
    Promise(
        "R3c", "a traceback of a command with a word that is wrong", 300, 20, _commands
    ),
    Promise(
        "R9",
        "a full disk that is not said, or half a file that counts",
        1,
        1,
        _tests("tests/test_written.py"),
    ),
    Promise(
        "R12",
        "a traceback, a crash or a hang from a mutated model, description or config",
        500,
        25,
        _files,
    ),
    Promise(
        "R14",
        "planning that needs GL, a home, a display, ffmpeg or the network",
        5,
        5,
        _without,
    ),
    Promise(
        "R15",
        "weights of NaN that are kept",
        1,
        1,
        _tests("tests/test_learning.py", "-k", "nan or finite or diverge"),
    ),
    Promise(
        "R16",
        "numbers that differ from closed forms, SciPy, toppra, mink or C MuJoCo",
        1,
        1,
        _tests(
            "tests/test_diffusion.py",
            "tests/test_trajectory.py",
            "tests/test_ik.py",
            "tests/test_scene.py",
        ),
    ),
    Promise(
        "R17",
        "a rate without an interval, or a wrong one",
        1,
        1,
        _tests("tests/test_evaluation.py", "tests/test_studies.py"),
    ),
)
