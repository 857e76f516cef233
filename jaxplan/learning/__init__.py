"""Losses, training loop, checkpoints, and the weights that come out."""

from jaxplan.learning.checkpoint import CheckpointError as CheckpointError
from jaxplan.learning.loop import RunError as RunError
from jaxplan.learning.loop import TrainingDiverged as TrainingDiverged
from jaxplan.learning.loop import fit as fit
from jaxplan.learning.loop import held_out as held_out
from jaxplan.learning.pretrained import NoWeights as NoWeights
from jaxplan.learning.pretrained import Weights as Weights
from jaxplan.learning.pretrained import WeightsError as WeightsError
from jaxplan.learning.pretrained import load_pair as load_pair
from jaxplan.learning.pretrained import load_weights as load_weights
from jaxplan.learning.pretrained import save_weights as save_weights
