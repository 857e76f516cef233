"""`python -m jaxplan.train KIND --config configs/NAME.py [--overrides]`.

KIND is predictor; sampler (diffusion), cvae, gan or few_step; the same for any scene, as
scene_sampler; or diffusion_policy, lstm_gmm or transformer.

Trains one network from demonstrations to exported weights. Started again, it goes on from
the run's newest checkpoint. `--help` lists every setting.
"""

import logging
import sys

from jaxplan import data, learning
from jaxplan.learning.command_line import UsageError, parse
from jaxplan.process import BAD_INPUT, exit_code
from jaxplan.trainings import files, trainings

logger = logging.getLogger(__name__)


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when done, 2 for bad input, 1 when training diverged."""
    # By force: a library has put its own handler there, which shows warnings only.
    logging.basicConfig(level=logging.INFO, format="%(message)s", force=True)
    logging.getLogger("absl").setLevel(logging.WARNING)
    known = trainings()
    try:
        given = sys.argv[1:] if arguments is None else arguments
        kind, config = parse(given, {name: t.settings for name, t in known.items()})
        data.check_writable(files.RUNS, True, "the directory of runs,")
        data.check_writable(config.out or files.RUNS, True, "--out")
        logger.info("weights: %s", known[kind].run(config))
        return 0
    except learning.TrainingDiverged as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"error: {error}", file=sys.stderr)
        return exit_code(error)
    except ValueError as error:
        expected = (
            UsageError,
            data.DataError,
            data.UnwritableError,
            learning.WeightsError,
            learning.CheckpointError,
            learning.RunError,
        )
        if not isinstance(error, expected):
            raise
        print(f"error: {error}", file=sys.stderr)
        return BAD_INPUT


if __name__ == "__main__":
    sys.exit(main())
