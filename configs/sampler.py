"""The diffusion sampler, compact: FiLM-MLP on the predictor's image features.

    python -m jaxplan.train sampler --config configs/sampler.py

About 4 minutes on two cores. On held-out episodes a drawn direction lies 3.0 degrees (median)
from the nearest true one, a true one 1.5 degrees from the nearest drawn. `--network.denoiser unet1d
--network.hidden 32 64 128` trains the U-Net instead.
"""

from jaxplan.config import OptimizerConfig, SamplerConfig, SamplerTraining

sampler = SamplerTraining(
    network=SamplerConfig(
        denoiser="film_mlp",
        hidden=(256, 256, 256),
        encoder=None,
        relative=True,
    ),
    out="jaxplan/pretrained",
    steps=10_000,
    batch_size=512,
    optimizer=OptimizerConfig(learning_rate=1e-3),
    log_every=100,
    validate_every=2000,
    checkpoint_every=2000,
)
