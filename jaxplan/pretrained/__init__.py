"""The weights that the package ships, and how weights are kept."""

from jaxplan.learning.weights import NoWeights as NoWeights
from jaxplan.learning.weights import Weights as Weights
from jaxplan.learning.weights import WeightsError as WeightsError
from jaxplan.pretrained.scene import load_sampler as load_sampler
from jaxplan.pretrained.store import DIRECTORY as DIRECTORY
from jaxplan.pretrained.store import UPPER as UPPER
from jaxplan.pretrained.store import load_pair as load_pair
from jaxplan.pretrained.store import load_weights as load_weights
from jaxplan.pretrained.store import save_weights as save_weights
from jaxplan.pretrained.store import shipped as shipped
