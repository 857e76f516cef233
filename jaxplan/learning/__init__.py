"""Losses, training loop, checkpoints."""

from jaxplan.learning.augment import AugmentConfig as AugmentConfig
from jaxplan.learning.checkpoint import CheckpointError as CheckpointError
from jaxplan.learning.loop import TrainConfig as TrainConfig
from jaxplan.learning.loop import TrainingDiverged as TrainingDiverged
from jaxplan.learning.loop import fit as fit
from jaxplan.learning.loop import held_out as held_out
from jaxplan.learning.losses import LossConfig as LossConfig
from jaxplan.learning.predictor import PredictorTraining as PredictorTraining
from jaxplan.learning.run import RunError as RunError
from jaxplan.learning.sampler import SegmentTraining as SegmentTraining
from jaxplan.learning.train_state import OptimizerConfig as OptimizerConfig
from jaxplan.learning.weights import NoWeights as NoWeights
from jaxplan.learning.weights import Weights as Weights
from jaxplan.learning.weights import WeightsError as WeightsError
