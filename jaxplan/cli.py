"""The command `jaxplan`."""

import difflib
import io
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import tyro
from tyro.conf import Positional

from jaxplan.interrupt import CLOSED, INTERRUPTED, end_on_interrupt
from jaxplan.process import BAD_INPUT, exit_code


@dataclass(frozen=True)
class SolveCommand:
    """Plans and executes one episode with the shipped weights."""

    seed: int
    """Of the episode; training never saw seeds from 100000 on."""
    variant: str = "plain"
    """Of the scene: `plain`, `cluttered` with obstacles across most straight lines, or `ways`."""
    out: Path | None = None
    """Directory for episode.json, a video and a film strip."""
    weights: Path | None = None
    """Directory with predictor, sampler and manifest; by default the package's own for the
    scene."""


@dataclass(frozen=True)
class PlanCommand:
    """Plans a motion of any MJCF's arm from one pose to another, and certifies it.

    Exit code 0 with a certified motion, 1 without (the reason is printed), 2 for bad input.
    """

    scene: Positional[Path]
    """MJCF file."""
    start: str
    """A key frame's name, or numbers with commas between them: a joint each [rad or m]."""
    goal: str
    """The same."""
    seed: int = 0
    """Of the search."""
    out: Path | None = None
    """Directory for plan.json: path, timed trajectory, versions."""
    video: bool = False
    """Renders the motion into plan.mp4, in --out."""
    joints: str | None = None
    """The arm's joints, with commas between them; by default the chain before the fingers."""
    hand: str | None = None
    """The arm's last body; by default the last before the fingers."""
    velocity: float = 1.0
    """Of each joint at most [rad/s or m/s]."""
    acceleration: float = 2.0
    """Of each joint at most [rad/s^2 or m/s^2]."""
    time_limit: float | None = None
    """After so long the search gives up [s]."""
    obstacles: Path | None = None
    """JSON file with obstacles that the model does not have, and objects that stand elsewhere:
    {"obstacles": [{"kind": "box", "size": [...], "pose": [...]}], "objects": {"cup": [...]}}."""
    sampler: Path | None = None
    """Directory with a sampler's weights, trained for this scene by `jaxplan record` and
    `python -m jaxplan.train scene_sampler`."""


@dataclass(frozen=True)
class RecordCommand:
    """Solves problems in a robot's cell, several ways each, for a sampler to learn from.

    A run that was killed goes on where it was, to the same bytes. Exit code 0 if anything was
    solved, 1 if not, 2 for bad input.
    """

    scene: Positional[Path]
    """MJCF file."""
    out: Path
    """Directory of the shards."""
    problems: Path | None = None
    """JSON file: {"problems": [...]}, or ranges within which problems are drawn
    (docs/sampler.md); by default any start and goal among what the model has."""
    count: int | None = None
    """How many problems are drawn, or taken of those given."""
    ways: int = 4
    """Paths of each problem."""
    seed: int = 0
    """Of problems and searches."""
    method: str = "rrt_connect"
    """Of the searches; `ao_rrt_connect` uses all of --expansions to find ever shorter paths."""
    expansions: int = 50_000
    """Of each search at most."""
    margin: float = 0.0
    """Clearance of the paths [m]."""
    joints: str | None = None
    """The arm's joints, with commas between them; by default the chain before the fingers."""
    hand: str | None = None
    """The arm's last body; by default the last before the fingers."""


@dataclass(frozen=True)
class CheckCommand:
    """Says what planning sees in an MJCF, and what is close or collides in a pose.

    Exit code 0 if the pose is free, 1 if it is not, 2 for bad input.
    """

    scene: Positional[Path]
    """MJCF file."""
    at: str | None = None
    """A key frame's name, or numbers with commas between them: a joint each [rad or m]. By
    default `home`, the first key frame, or the reference pose."""
    joints: str | None = None
    """The arm's joints, with commas between them; by default the chain before the fingers."""
    hand: str | None = None
    """The arm's last body; by default the last before the fingers."""


COMMANDS = {
    "plan": PlanCommand,
    "check": CheckCommand,
    "record": RecordCommand,
    "solve": SolveCommand,
}


def main(arguments: list[str] | None = None) -> int:
    """Runs a command; 0 when done, 1 if the answer is no, 2 for bad input.

    Args:
        arguments: None: this process is the command, with those of its command line.
    """
    if arguments is None:
        _be_a_program()
    return _guarded(lambda: _run(sys.argv[1:] if arguments is None else arguments))


def _run(arguments: list[str]) -> int:
    if arguments and not arguments[0].startswith("-") and arguments[0] not in COMMANDS:
        near = difflib.get_close_matches(arguments[0], COMMANDS, 1)
        known = f" (there is: {', '.join(COMMANDS)})"
        hint = f"; did you mean {near[0]}?" if near else known
        return _fail(f"unknown command {arguments[0]!r}{hint}")
    command = tyro.extras.subcommand_cli_from_dict(
        COMMANDS, prog="jaxplan", args=arguments
    )
    return RUN[type(command)](command)


def run_script(main: Callable[[Any], None], arguments: type) -> NoReturn:
    """Parses a script's command line into `arguments`, runs `main` on it, and exits.

    The scripts of `train/` and `eval/` end here: 0 when done, 2 and one line for bad input.
    """
    _be_a_program()

    def run() -> int:
        given = tyro.cli(arguments)
        if out := getattr(given, "out", None):
            usual = arguments.__dataclass_fields__["out"].default
            _check_out(out, directory=isinstance(usual, Path) and not usual.suffix)
        main(given)
        return 0

    sys.exit(_guarded(run))


def _be_a_program() -> None:
    """Ctrl-C ends the process, and a line is written when it is printed."""
    end_on_interrupt()
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)


def _guarded(run: Callable[[], int]) -> int:
    """The exit code of `run`; bad input is one line and 2, a closed pipe is no error."""
    try:
        return run()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # What is still to be written, at exit, goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return CLOSED
    except (ValueError, RuntimeError, OSError) as error:
        _fail((str(error) or type(error).__name__).splitlines()[0])
        return exit_code(error)


def _plan(command: PlanCommand) -> int:
    _check_seed(command.seed)
    _check_out(command.out)
    _keep_compiled()
    from jaxplan.commands.plan import plan

    given = vars(command).copy()
    return 0 if plan(given.pop("scene"), **given) else 1


def _record(command: RecordCommand) -> int:
    _check_seed(command.seed)
    _check_out(command.out)
    _keep_compiled()
    import dataclasses

    from jaxplan.cells import RecordConfig
    from jaxplan.commands.record import record
    from jaxplan.ranges import Count, check

    if command.count is not None:
        check("count", command.count, Count)
    usual = RecordConfig()
    planner = dataclasses.replace(
        usual.planner,
        method=command.method,
        max_expansions=command.expansions,
        margin=command.margin,
    )
    config = RecordConfig(command.ways, command.seed, usual.shard_size, planner)
    names = "problems", "count", "out", "joints", "hand"
    given = {name: getattr(command, name) for name in names}
    return 0 if record(command.scene, **given, config=config) else 1


def _check(command: CheckCommand) -> int:
    from jaxplan.commands.check import check

    given = vars(command).copy()
    return 0 if check(given.pop("scene"), **given) else 1


def _solve(command: SolveCommand) -> int:
    _check_seed(command.seed)
    _check_out(command.out)
    _keep_compiled()
    from jaxplan import tasks
    from jaxplan.evaluation import ClosedLoopConfig
    from jaxplan.pretrained import load_pair, shipped
    from jaxplan.solve import solve

    config = ClosedLoopConfig(variant=command.variant)
    tasks.check(config.task, config.variant)
    weights = load_pair(command.weights or shipped(command.variant))
    episode = solve(command.seed, weights, command.out, config)
    return 0 if episode["success"] else 1


# They import when they run, so that `--help` and a typo answer at once.
RUN = {
    PlanCommand: _plan,
    CheckCommand: _check,
    RecordCommand: _record,
    SolveCommand: _solve,
}


def _check_seed(seed: int) -> None:
    if not 0 <= seed < 2**31:
        raise ValueError(f"seed {seed}: expected 0 to {2**31 - 1}")


def _check_out(out: Path | None, directory: bool = True) -> None:
    if out is not None:
        from jaxplan.data import check_writable

        check_writable(out, directory, "--out")


def _keep_compiled() -> None:
    """Keeps compiled programs for the next run, where the user has not said otherwise."""
    import jax

    if not os.environ.get("JAX_COMPILATION_CACHE_DIR"):
        home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        jax.config.update(
            "jax_compilation_cache_dir", str(Path(home, "jaxplan", "jax"))
        )
    if not os.environ.get("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"):
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def _fail(message: str) -> int:
    print(f"error: {message}", file=sys.stderr)
    return BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
