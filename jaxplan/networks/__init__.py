"""The neural networks; the only package that imports Flax."""

from jaxplan.networks.condition import Cond as Cond
from jaxplan.networks.cvae import CvaeNetwork as CvaeNetwork
from jaxplan.networks.gan import GanNetwork as GanNetwork
from jaxplan.networks.initial import init as init
from jaxplan.networks.initial import network as network
from jaxplan.networks.joints import normalize as normalize
from jaxplan.networks.joints import unnormalize as unnormalize
from jaxplan.networks.predictor import Prediction as Prediction
from jaxplan.networks.predictor import Predictor as Predictor
from jaxplan.networks.predictor import Subgoal as Subgoal
from jaxplan.networks.predictor import as_subgoal as as_subgoal
from jaxplan.networks.predictor import predict as predict
from jaxplan.networks.resnet import Encoder as Encoder
from jaxplan.networks.sampler import SamplerNetwork as SamplerNetwork
