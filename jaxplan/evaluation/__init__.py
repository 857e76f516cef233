"""What every script in `eval/` shares: seeds, intervals, provenance, the success study."""

from jaxplan.evaluation.seeds import parse_seeds as parse_seeds
from jaxplan.evaluation.statistics import wilson as wilson
from jaxplan.evaluation.success import Study as Study
from jaxplan.evaluation.success import Success as Success
from jaxplan.evaluation.success import evaluate as evaluate
from jaxplan.provenance import versions as versions
