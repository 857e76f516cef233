"""Learned proposals: families of samplers, and banks of segments that they draw."""

from jaxplan.samplers.bank import Bank as Bank
from jaxplan.samplers.cvae import CvaeTraining as CvaeTraining
from jaxplan.samplers.diffusion import SamplerTraining as SamplerTraining
from jaxplan.samplers.families import FAMILIES as FAMILIES
from jaxplan.samplers.families import draw as draw
from jaxplan.samplers.families import family_of as family_of
from jaxplan.samplers.families import init as init
from jaxplan.samplers.family import Family as Family
from jaxplan.samplers.few_step import FewStepTraining as FewStepTraining
from jaxplan.samplers.gan import GanTraining as GanTraining
from jaxplan.samplers.scene import SceneSampler as SceneSampler
