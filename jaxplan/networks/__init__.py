"""The neural networks; the only package that imports Flax."""

from jaxplan.networks.condition import AnyCond as AnyCond
from jaxplan.networks.condition import Cond as Cond
from jaxplan.networks.condition import SegmentConfig as SegmentConfig
from jaxplan.networks.cvae import CvaeConfig as CvaeConfig
from jaxplan.networks.cvae import CvaeNetwork as CvaeNetwork
from jaxplan.networks.diffusion_policy import (
    DiffusionPolicyConfig as DiffusionPolicyConfig,
)
from jaxplan.networks.diffusion_policy import (
    DiffusionPolicyNetwork as DiffusionPolicyNetwork,
)
from jaxplan.networks.gan import GanConfig as GanConfig
from jaxplan.networks.gan import GanNetwork as GanNetwork
from jaxplan.networks.hand_camera import ERROR_SCALE as ERROR_SCALE
from jaxplan.networks.hand_camera import HandCameraConfig as HandCameraConfig
from jaxplan.networks.joints import normalize as normalize
from jaxplan.networks.joints import unnormalize as unnormalize
from jaxplan.networks.lstm_gmm import LstmGmmConfig as LstmGmmConfig
from jaxplan.networks.lstm_gmm import LstmGmmNetwork as LstmGmmNetwork
from jaxplan.networks.policy import WINDOW as WINDOW
from jaxplan.networks.policy import Chunk as Chunk
from jaxplan.networks.policy import PolicyConfig as PolicyConfig
from jaxplan.networks.policy import Window as Window
from jaxplan.networks.policy import decode as decode
from jaxplan.networks.policy import encode as encode
from jaxplan.networks.policy import plain as plain
from jaxplan.networks.policy import with_sight as with_sight
from jaxplan.networks.predictor import Prediction as Prediction
from jaxplan.networks.predictor import Predictor as Predictor
from jaxplan.networks.predictor import PredictorConfig as PredictorConfig
from jaxplan.networks.predictor import as_subgoal as as_subgoal
from jaxplan.networks.predictor import predict as predict
from jaxplan.networks.resnet import Encoder as Encoder
from jaxplan.networks.resnet import EncoderConfig as EncoderConfig
from jaxplan.networks.resnet import Encoding as Encoding
from jaxplan.networks.rows import row_by_row as row_by_row
from jaxplan.networks.sampler import FewStepConfig as FewStepConfig
from jaxplan.networks.sampler import SamplerConfig as SamplerConfig
from jaxplan.networks.sampler import SamplerNetwork as SamplerNetwork
from jaxplan.networks.surroundings import SceneCond as SceneCond
from jaxplan.networks.surroundings import SurroundingsConfig as SurroundingsConfig
from jaxplan.networks.transformer import TransformerConfig as TransformerConfig
from jaxplan.networks.transformer import TransformerNetwork as TransformerNetwork
