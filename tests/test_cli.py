"""The command `jaxplan`: bad input gets one line and exit code 2."""

import ctypes.util
import sys

import numpy as np
import pytest

from jaxplan.cli import main
from jaxplan.config import PredictorConfig
from jaxplan.learning.pretrained import save_weights


@pytest.fixture
def refused(capsys):
    """Runs the command, which must refuse; returns its one line."""

    def run(*arguments: object) -> str:
        assert main([str(argument) for argument in arguments]) == 2
        output = capsys.readouterr()
        assert output.out == ""
        assert output.err.startswith("error: ")
        assert output.err.count("\n") == 1
        return output.err

    return run


def test_an_unknown_command_gets_a_suggestion(refused):
    assert "did you mean solve?" in refused("slove", "--seed", 0)
    assert "there is: solve" in refused("xyz")


@pytest.mark.parametrize("seed", [-1, 2**31])
def test_a_seed_out_of_range_is_refused(refused, seed):
    assert f"seed {seed}" in refused("solve", "--seed", seed)


@pytest.mark.parametrize("seed", ["one", "1.5", ""])
def test_a_seed_that_is_no_number_is_refused(seed):
    with pytest.raises(SystemExit) as stop:
        main(["solve", "--seed", seed])
    assert stop.value.code == 2


def test_missing_weights_are_named(refused, tmp_path):
    line = refused("solve", "--seed", 0, "--weights", tmp_path / "nowhere")
    assert "missing weights" in line
    assert "nowhere" in line


def test_damaged_weights_are_named(refused, tmp_path):
    params = {"kernel": np.zeros((3, 4), np.float32)}
    path = save_weights(tmp_path, "predictor", params, PredictorConfig(), {})
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    line = refused("solve", "--seed", 0, "--weights", tmp_path)
    assert "damaged weights" in line
    assert "predictor.npz" in line


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere MuJoCo brings its own")
def test_without_gl_it_says_what_to_install(refused, monkeypatch):
    class Blind:
        """Stands where the networks would: the camera is asked before them."""

        def __init__(self, *_):
            self.predict = self.propose = None

    monkeypatch.setattr("jaxplan.learning.load_pair", lambda _: (None, None))
    monkeypatch.setattr("jaxplan.evaluation.success.Agent", Blind)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    line = refused("solve", "--seed", 0)
    assert line.count("apt install") == 1
    assert "OpenGL" in line
