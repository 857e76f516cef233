"""What every script in `eval/` shares: seeds, intervals, provenance, the closed loop."""

from jaxplan.evaluation.closed_loop import ClosedLoop as ClosedLoop
from jaxplan.evaluation.closed_loop import ClosedLoopConfig as ClosedLoopConfig
from jaxplan.evaluation.closed_loop import evaluate as evaluate
from jaxplan.evaluation.seeds import parse_seeds as parse_seeds
from jaxplan.evaluation.statistics import wilson as wilson
from jaxplan.provenance import versions as versions
