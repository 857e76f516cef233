"""The command `jaxplan`."""

import difflib
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import tyro


@dataclass(frozen=True)
class Solve:
    """Plans and executes one mug episode with the shipped weights."""

    seed: int
    """Of the mug's pose; training never saw seeds from 100000 on."""
    out: Path | None = None
    """Directory for episode.json, a video and a film strip."""
    weights: Path | None = None
    """Directory with predictor, sampler and manifest; the package's own by default."""


COMMANDS = {"solve": Solve}


def main(arguments: list[str] | None = None) -> int:
    """Runs a command; 0 when done, 1 if the episode failed, 2 for bad input."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments and not arguments[0].startswith("-") and arguments[0] not in COMMANDS:
        near = difflib.get_close_matches(arguments[0], COMMANDS, 1)
        known = f" (there is: {', '.join(COMMANDS)})"
        hint = f"; did you mean {near[0]}?" if near else known
        return _fail(f"unknown command {arguments[0]!r}{hint}")
    command = tyro.extras.subcommand_cli_from_dict(
        COMMANDS, prog="jaxplan", args=arguments
    )
    return _guarded(lambda: _solve(command))


def run_script(main: Callable[[Any], None], arguments: type) -> NoReturn:
    """Parses a script's command line into `arguments`, runs `main` on it, and exits.

    The scripts of `train/` and `eval/` end here: 0 when done, 2 and one line for bad input.
    """
    options = tyro.cli(arguments)

    def run() -> int:
        main(options)
        return 0

    sys.exit(_guarded(run))


def _guarded(run: Callable[[], int]) -> int:
    """The exit code of `run`; bad input is one line and 2."""
    try:
        return run()
    except (ValueError, RuntimeError, OSError) as error:
        return _fail((str(error) or type(error).__name__).splitlines()[0])


def _solve(command: Solve) -> int:
    if not 0 <= command.seed < 2**31:
        raise ValueError(f"seed {command.seed}: expected 0 to {2**31 - 1}")
    # Here, so that `--help` and a typo answer at once.
    from jaxplan.learning import load_pair
    from jaxplan.learning.pretrained import DIRECTORY
    from jaxplan.solve import solve

    weights = load_pair(command.weights or DIRECTORY)
    episode = solve(command.seed, weights, command.out)
    return 0 if episode["success"] else 1


def _fail(message: str) -> int:
    print(f"error: {message}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
