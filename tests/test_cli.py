"""The command `jaxplan`: bad input gets one line and exit code 2."""

import ctypes.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import imageio.v3 as iio
import jax
import numpy as np
import pytest

from jaxplan.cli import main
from jaxplan.pretrained import DIRECTORY

ARM = Path(__file__).parents[1] / "docs" / "arm.xml"


@pytest.fixture(autouse=True)
def _users_own_cache(monkeypatch, tmp_path):
    """The commands leave JAX's cache as it is."""
    monkeypatch.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path))


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
    assert "there is: plan, check, record, solve" in refused("xyz")


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
    for name in ("manifest.json", "predictor.npz"):
        shutil.copy(DIRECTORY / name, tmp_path)
    path = tmp_path / "predictor.npz"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    line = refused("solve", "--seed", 0, "--weights", tmp_path)
    assert "damaged weights" in line
    assert "predictor.npz" in line


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere MuJoCo brings its own")
def test_without_gl_it_says_what_to_install(refused, monkeypatch):
    monkeypatch.setattr("jaxplan.pretrained.load_pair", lambda _: (None, None))
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    line = refused("solve", "--seed", 0)
    assert line.count("apt install") == 1
    assert "OpenGL" in line


@pytest.mark.parametrize(
    ("start", "goal", "words"),
    [
        ("hom", "left", "start: no key frame 'hom': did you mean 'home'?"),
        ("left", "up", "goal: no key frame 'up'"),
        (
            "left",
            "0.1,-0.4",
            "goal has 2 numbers, expected 4: turn, lift, elbow, wrist",
        ),
        ("left", "-0.1", "goal has 1 numbers, expected 4"),
        ("0,0,0,0,0", "left", "start has 5 numbers"),
        ("left", "", "goal has 0 numbers"),
        ("left", "nan,0,0,0", "goal is not finite: joint 'turn' is nan"),
        ("0,-inf,0,0", "left", "start is not finite: joint 'lift' is -inf"),
        ("left", "-0.1,0.2,x,0", "goal: 'x' is not a number"),
    ],
)
def test_a_pose_that_is_none_is_named(refused, start, goal, words):
    assert words in refused("plan", ARM, "--start", start, "--goal", goal)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--seed", -1], "seed -1"),
        (["--video"], "--video needs --out"),
        (["--joints", "turn,lif"], "no joint 'lif': did you mean 'lift'?"),
        (["--hand", "hnd"], "no body 'hnd': did you mean 'hand'?"),
        (["--velocity", 0], "velocity 0"),
        (["--acceleration", "nan"], "acceleration nan"),
        (["--out", ARM], "arm.xml"),
    ],
)
def test_an_option_that_makes_no_sense_is_named(refused, options, words):
    assert words in refused("plan", ARM, "--start", "left", "--goal=home", *options)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "no such file"),
        ("", "empty"),
        ("<mujoco><worldbody></mujoco>", "XML"),
        ("<mujoco><worldbody/></mujoco>", "no hinge or slide joint"),
        ("\0\1\2" * 99, "robot.xml"),
    ],
)
@pytest.mark.parametrize("command", ["plan", "check"])
def test_a_file_that_is_no_model_is_refused(refused, tmp_path, command, text, words):
    path = tmp_path / "robot.xml"
    if text is not None:
        path.write_text(text)
    poses = ["--start", "a", "--goal", "b"] if command == "plan" else []
    assert words in refused(command, path, *poses)


def test_a_height_field_is_refused_by_name(refused, tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(
        "<mujoco><asset><hfield name='hills' nrow='2' ncol='2' size='1 1 1 1'/></asset>"
        "<worldbody><geom name='hills' type='hfield' hfield='hills'/><body pos='0 0 3'>"
        "<joint name='j'/><geom size='1'/></body></worldbody></mujoco>"
    )
    assert "'hills' is a height field" in refused("check", path)


@pytest.mark.filterwarnings("ignore:os.fork")  # the test reads the video
def test_a_plan_is_written_certified_and_filmed(tmp_path, capsys):
    out = tmp_path / "out"
    goal = "-0.9,0.9,0.9,0.4"
    command = ["plan", str(ARM), "--start", "left", "--goal", goal]
    assert main([*command, "--out", str(out), "--video", "--seed", "3"]) == 0
    output = capsys.readouterr().out
    for words in (
        "solved",
        "expansions",
        "waypoints",
        "certificate of the motion: free",
    ):
        assert words in output
    record = json.loads((out / "plan.json").read_text())
    assert record["status"] == "solved"
    assert record["seed"] == 3
    assert record["certified"] == {"path": True, "motion": True}
    np.testing.assert_allclose(record["path"][0], [0.9, 0.9, 0.9, 0.4], atol=1e-6)
    np.testing.assert_allclose(
        record["path"][-1], np.array(goal.split(","), float), atol=1e-6
    )
    timed = {name: np.array(rows) for name, rows in record["trajectory"].items()}
    assert timed["q"].shape == timed["qd"].shape == (len(timed["t"]), 4)
    assert record["versions"]["jax"]
    frames = iio.imread(out / "plan.mp4")
    assert len(frames) == pytest.approx(30 * timed["t"][-1], abs=3)
    assert np.abs(frames[0].astype(int) - frames[-1]).max() > 50


def jaxplan(*arguments: object, stdout: int = subprocess.PIPE, **env: str):
    """Runs the command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "jaxplan", *map(str, arguments)],
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | env,
        cwd=ARM.parents[1],
        timeout=120,
    )


@pytest.mark.parametrize("command", [["check", ARM], ["--help"]], ids=["check", "help"])
def test_a_closed_pipe_is_no_error(command):
    reader, writer = os.pipe()
    os.close(reader)
    done = jaxplan(*command, stdout=writer)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere MuJoCo brings its own")
def test_who_does_not_render_does_not_care_for_gl(tmp_path):
    done = jaxplan("check", ARM, MUJOCO_GL="nonsense")
    assert (done.returncode, done.stderr) == (0, "")
    film = (
        "plan",
        ARM,
        "--start=left",
        "--goal=home",
        "--out",
        tmp_path / "o",
        "--video",
    )
    for command in (film, ("solve", "--seed", 0)):
        done = jaxplan(*command, MUJOCO_GL="nonsense")
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith("error: MUJOCO_GL=nonsense cannot render")
        assert done.stderr.count("\n") == 1
        assert "apt install" in done.stderr
    assert not (tmp_path / "o").exists()


def test_what_a_run_before_has_left_is_removed_and_nothing_else(tmp_path, capsys):
    for name in ("plan.mp4", "plan.json", "notes.txt"):
        (tmp_path / name).write_text("old")
    command = ["plan", str(ARM), "--start=left", "--out", str(tmp_path)]
    assert main([*command, "--goal=0,0,0"]) == 2  # asks nothing, writes nothing
    assert (tmp_path / "plan.json").read_text() == "old"
    assert main([*command, "--goal=0.8,0.9,0.9,0.4"]) == 0
    assert {file.name for file in tmp_path.iterdir()} == {"plan.json", "notes.txt"}
    assert json.loads((tmp_path / "plan.json").read_text())["status"] == "solved"


def test_what_is_not_solved_is_1_with_its_reason(tmp_path, capsys):
    path = tmp_path / "robot.xml"
    path.write_text(
        "<mujoco><worldbody><geom size='0.1'/><body pos='0 0 1'>"
        "<joint name='j' axis='0 1 0' range='-90 90'/><geom size='0.1'/>"
        "</body></worldbody></mujoco>"
    )
    command = ["plan", str(path), "--start=0.5", "--out", str(tmp_path)]
    assert main([*command, "--goal", "-7"]) == 1
    assert "goal out of limits: joint 'j' at -7.0000" in capsys.readouterr().out
    record = json.loads((tmp_path / "plan.json").read_text())
    assert record["status"] == "out_of_limits"
    assert record["trajectory"] is None


def test_check_says_what_planning_sees(capsys):
    assert main(["check", str(ARM)]) == 0
    output = capsys.readouterr().out
    for words in (
        "4 joints, hand 'hand'",
        "turn: hinge, -3.0000 to 3.0000 rad",
        "objects: cup",
        "geoms that can touch: 4 capsule, 1 plane, 2 sphere",
        "pose 'home': free",
    ):
        assert words in output
    assert "<exclude" not in output


def leg(side: str, joints: int) -> str:
    link = f'<joint name="{side}%d" axis="0 1 0"/><geom size="0.05"/>'
    text = "".join(
        f'<body name="{side}_b{i}" pos="0 0 -1">{link % i}' for i in range(joints)
    )
    return text + "</body>" * joints


def test_check_lists_many_joints_by_their_chains(tmp_path, capsys):
    path = tmp_path / "robot.xml"
    path.write_text(
        "<mujoco><worldbody><body name='torso' pos='0 0 9'><joint name='waist'/>"
        f"<joint name='rail' type='slide' range='-1 1'/><geom size='0.1'/>"
        f"{leg('left', 5)}{leg('right', 5)}</body></worldbody></mujoco>"
    )
    main(["check", str(path), "--joints=waist,rail"])
    lines = capsys.readouterr().out.splitlines()
    assert "  waist: hinge, no limits, goes round" in lines
    assert "  rail: slide, -1.0000 to 1.0000 m" in lines
    assert "  from left_b0: left0, left1, left2, left3, left4" in lines
    assert "  from right_b0: right0, right1, right2, right3, right4" in lines
    both = ",".join(f"{side}{i}" for side in ("left", "right") for i in range(5))
    main(["check", str(path), f"--joints={both}"])
    lines = capsys.readouterr().out.splitlines()
    assert lines.index(" from left_b0:") < lines.index(" from right_b0:")
    assert "other joints: waist, rail" in lines


def test_check_names_what_collides(capsys):
    assert main(["check", str(ARM), "--at", "-0.1,1.2,0.9,0"]) == 1
    output = capsys.readouterr().out
    assert "in collision" in output
    assert "post" in output


def test_check_says_what_is_left_out(tmp_path, capsys):
    path = tmp_path / "robot.xml"
    path.write_text(
        """
        <mujoco><worldbody>
          <body name="a"><joint name="i"/><geom size="0.1"/>
            <body name="b" pos="0 0 0.05"><joint name="j" axis="1 0 0"/>
              <geom size="0.02" pos="0 0 1"/>
              <body name="c"><joint name="k" axis="0 1 0"/><geom size="0.1"/></body>
            </body>
          </body>
        </worldbody></mujoco>
        """
    )
    assert main(["check", str(path)]) == 0
    assert "pair left out: a[0] and c[0]" in capsys.readouterr().out


def test_compiled_programs_are_kept(monkeypatch, tmp_path):
    from jaxplan.cli import _keep_compiled

    names = "jax_compilation_cache_dir", "jax_persistent_cache_min_compile_time_secs"
    before = {name: getattr(jax.config, name) for name in names}
    try:
        _keep_compiled()
        assert jax.config.jax_compilation_cache_dir == before[names[0]]
        monkeypatch.delenv("JAX_COMPILATION_CACHE_DIR")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
        _keep_compiled()
        assert jax.config.jax_compilation_cache_dir == str(tmp_path / "jaxplan" / "jax")
    finally:
        for name, value in before.items():
            jax.config.update(name, value)
