"""The diffusion sampler as in the paper: 1-D U-Net, own ResNet-18. For a GPU.

    python -m jaxplan.train sampler --config configs/sampler_paper.py

50,000 steps of 128 images; on two CPU cores it would take 19 hours or more. Not yet run to
the end.
"""

from jaxplan.config import SamplerTraining

sampler = SamplerTraining(name="sampler_paper", steps=50_000, batch_size=128)
