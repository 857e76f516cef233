"""What is written: whether it can be, before hours of work, and of what it was made."""

import ast
import errno
import itertools
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock
from toy_demonstrations import demonstrations
from toy_training import TOY, toy

from jaxplan import cli, data, learning, tasks, train
from jaxplan.data import check_writable
from jaxplan.trainings import files

ROOT = Path(__file__).parents[1]
CONFIGS = ROOT / "configs"
SCRIPTS = sorted([*ROOT.glob("eval/*.py"), *ROOT.glob("train/*.py")])


@pytest.fixture
def places(tmp_path):
    """Of every kind: there and not, of files and of directories."""
    (tmp_path / "file").write_text("kept")
    (tmp_path / "directory").mkdir()
    return {
        "file": tmp_path / "file",
        "directory": tmp_path / "directory",
        "new": tmp_path / "new",
        "new, deep": tmp_path / "a" / "b" / "new",
        "below a file": tmp_path / "file" / "new",
        "far below a file": tmp_path / "file" / "a" / "new",
        "where nobody may": Path("/proc/new"),
    }


REFUSED = {
    (False, "directory"): "is a directory",
    (True, "file"): "is a file",
    **{
        (directory, place): words
        for directory in (False, True)
        for place, words in (
            ("below a file", "is a file"),
            ("far below a file", "is a file"),
            ("where nobody may", "/proc: "),
        )
    },
}


def test_it_is_known_before_whether_something_can_be_written(places, tmp_path):
    """Files and directories, at every kind of place; nothing is left behind."""
    before = sorted(tmp_path.rglob("*"))
    for directory, (name, place) in itertools.product((False, True), places.items()):
        words = REFUSED.get((directory, name))
        if words is None:
            check_writable(place, directory, "--out")
        else:
            with pytest.raises(ValueError, match=f"^--out {place}: .*{words}"):
                check_writable(place, directory, "--out")
    assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("def broken(:", "SyntaxError"),
        ("import nothing_of_this_name", "ModuleNotFoundError"),
        ("predictor = 1 / 0", "ZeroDivisionError"),
        ("raise SystemError", "SystemError: no reason given"),
        ("predictor = 3", "defines no `predictor"),
    ],
)
def test_a_broken_config_is_one_line(tmp_path, capsys, text, words):
    config = tmp_path / "config.py"
    config.write_text(text)
    assert train.main(["predictor", "--config", str(config)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {config}")
    assert words in said
    assert said.count("\n") == 1


def test_weights_that_cannot_be_written_are_known_at_once(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    debug = ["predictor", "--config", str(CONFIGS / "debug.py"), "--data", "nowhere"]
    assert train.main([*debug, "--out", "file"]) == 2
    assert capsys.readouterr().err == "error: --out file: file is a file\n"
    (tmp_path / "runs").touch()
    assert train.main(debug) == 2
    assert "the directory of runs, runs: runs is a file" in capsys.readouterr().err


def test_a_full_disk_is_no_bad_input(capsys):
    """One line, and 1 where other errors of the system are 2."""

    def full():
        raise OSError(errno.ENOSPC, "No space left on device")

    def gone():
        raise FileNotFoundError(errno.ENOENT, "No such file", "here")

    assert cli._guarded(full) == 1
    assert cli._guarded(gone) == 2
    assert capsys.readouterr().err.count("\n") == 2


def test_every_script_checks_its_arguments():
    """By their types' ranges, as all configs."""
    for path in SCRIPTS:
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ClassDef) and node.name == "Args":
                bases = {ast.unparse(base) for base in node.bases}
                assert bases & {"Checked", "StudyArgs"}, path


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"batch": 0}, "batch 0"),
        ({"batch": 2.5}, "batch 2.5"),
        ({"batch": True}, "batch True"),
        ({"friction": float("nan")}, "friction nan"),
        ({"friction": -1.0}, "friction -1.0"),
    ],
)
def test_a_task_of_senseless_numbers_is_refused_by_name(given, words):
    with pytest.raises(ValueError, match=f"^{words}, expected"):
        tasks.load("mug", **{"batch": 1, **given})


def test_a_run_goes_on_with_what_it_was_begun_with(tmp_path):
    """Other data, another predictor, another process: refused by name."""
    run = tmp_path / "run"
    begun = {"data": {"mug": "1"}, "predictor_sha256": "2"}
    with pytest.raises(KeyboardInterrupt):
        toy(TOY, run, stop=17, origin=begun)
    for name, value in (("data", {"mug": "0"}), ("predictor_sha256", "0")):
        with pytest.raises(learning.RunError, match=f"begun with another {name}"):
            toy(TOY, run, origin=begun | {name: value})
    with (
        FileLock(run / ".lock"),
        pytest.raises(learning.RunError, match="another process trains"),
    ):
        toy(TOY, run, origin=begun)
    state, _ = toy(TOY, run, origin=begun)
    assert int(state.step) == TOY.steps


def test_directories_of_one_name_are_told_apart(tmp_path):
    """In the manifest, and so in the cache of features and in what a run was begun with."""
    for place in ("a", "b"):
        directory = tmp_path / place / "mug"
        directory.mkdir(parents=True)
        shard = demonstrations()
        shard = shard._replace(seed=shard.seed + 100 * (place == "b"))
        data.write_shard(data.shard_path(directory, 0), shard)
        data.write_manifest(directory, {"task": "mug"})
    both = tuple(str(tmp_path / place / "mug") for place in ("a", "b"))
    _, origin = files.read(TOY.__class__(name="toy", data=both), data.Shard)
    assert list(origin["data"]) == ["mug", "mug (2)"]
    assert len(set(origin["data"].values())) == 2
    shutil.rmtree(tmp_path / "a")
    assert json.dumps(origin)
    assert np.all([len(value) == 64 for value in origin["data"].values()])
