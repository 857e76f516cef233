"""From seeds to weights to an evaluation, through the doors that people use, in small."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
COLLECT = [
    sys.executable,
    "train/collect_demos.py",
    "--shard-size",
    "4",
    "--workers",
    "1",
]


def run(*command: str, timeout: float = 600) -> subprocess.CompletedProcess:
    return subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=timeout, check=False
    )


def digests(directory: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(directory.iterdir())}


@pytest.fixture(scope="module")
def demonstrations(tmp_path_factory):
    out = tmp_path_factory.mktemp("data") / "mug"
    done = run(*COLLECT, "--episodes", "8", "--out", str(out))
    assert done.returncode == 0, done.stderr[-2000:]
    return out


@pytest.fixture(scope="module")
def weights(demonstrations, tmp_path_factory):
    """Trained for a few steps: they know nothing, but every door has been used."""
    out = tmp_path_factory.mktemp("weights")
    runs = tmp_path_factory.mktemp("runs")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for kind, more in (("predictor", []), ("sampler", ["--predictor", str(out)])):
        command = [sys.executable, "-m", "jaxplan.train", kind]
        command += ["--config", str(ROOT / "configs/debug.py")]
        command += ["--data", str(demonstrations), "--out", str(out), *more]
        done = subprocess.run(
            command,
            cwd=runs,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr[-2000:]
    return out


def test_a_lost_shard_is_made_again_byte_for_byte(demonstrations, tmp_path):
    """Interrupted and resumed, the data set is what it would have been."""
    copy = tmp_path / "mug"
    shutil.copytree(demonstrations, copy)
    (copy / "shard_00001.npz").unlink()
    done = run(*COLLECT, "--episodes", "8", "--out", str(copy))
    assert done.returncode == 0, done.stderr[-2000:]
    assert digests(copy) == digests(demonstrations)


def test_other_settings_are_refused(demonstrations):
    """A directory that was begun with other settings is left alone."""
    command = [*COLLECT, "--episodes", "8", "--out", str(demonstrations)]
    done = run(*command, "--first-seed", "7")
    assert done.returncode == 2
    assert done.stderr.strip().splitlines()[-1].startswith("error: ")
    assert "Traceback" not in done.stderr


def test_the_weights_go_through_the_evaluation(weights, tmp_path):
    """The evaluation's JSON has what it promises, however poor the weights."""
    out = tmp_path / "success.json"
    done = run(
        sys.executable, "eval/success.py", "--seeds", "100000:100002",
        "--weights", str(weights), "--out", str(out), "--study.episode.max-phases", "4",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    result = json.loads(out.read_text())
    assert {"success_rate", "wilson_95", "episodes", "config", "versions"} <= set(
        result
    )
    assert [episode["seed"] for episode in result["episodes"]] == [100000, 100001]
    for episode in result["episodes"]:
        assert {"success", "failure", "expansions", "planning_seconds"} <= set(episode)
        assert episode["success"] or episode["failure"]


def test_an_empty_seed_range_is_refused(weights):
    done = run(
        sys.executable, "eval/success.py", "--seeds", "5:5", "--weights", str(weights)
    )
    assert done.returncode == 2
    assert "FIRST < END" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_killed_and_resumed_the_data_set_is_the_same(demonstrations, tmp_path):
    """`kill -9` in the middle of collecting costs time only."""
    out = tmp_path / "mug"
    command = [*COLLECT, "--episodes", "8", "--out", str(out)]
    process = subprocess.Popen(command, cwd=ROOT, start_new_session=True)
    deadline = time.monotonic() + 600
    while not (out / "shard_00000.npz").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert not (out / "shard_00001.npz").exists(), "killed too late to show anything"
    done = run(*command)
    assert done.returncode == 0, done.stderr[-2000:]
    assert digests(out) == digests(demonstrations)
