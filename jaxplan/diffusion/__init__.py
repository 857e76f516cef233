"""Denoising diffusion over segments: schedule, loss, DDIM, coding. Maths only."""

from jaxplan.diffusion.coding import bounds as bounds
from jaxplan.diffusion.coding import decode as decode
from jaxplan.diffusion.coding import decode_base as decode_base
from jaxplan.diffusion.coding import encode as encode
from jaxplan.diffusion.coding import encode_base as encode_base
from jaxplan.diffusion.ddim import ddim as ddim
from jaxplan.diffusion.ddim import ddim_path as ddim_path
from jaxplan.diffusion.ddim import timesteps as timesteps
from jaxplan.diffusion.loss import Denoise as Denoise
from jaxplan.diffusion.loss import eps_loss as eps_loss
from jaxplan.diffusion.schedule import add_noise as add_noise
from jaxplan.diffusion.schedule import alphas_cumprod as alphas_cumprod
from jaxplan.diffusion.schedule import squaredcos_cap_v2 as squaredcos_cap_v2
