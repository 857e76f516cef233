"""The diffusion sampler, compact: FiLM-MLP on the predictor's image features.

    python -m jaxplan.train sampler --config configs/sampler.py

About 10 minutes on two quiet cores. Expected on held-out episodes: a drawn direction lies
a few degrees (median) from the nearest true one. `--network.denoiser unet1d
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
    steps=16_000,
    batch_size=512,
    optimizer=OptimizerConfig(learning_rate=1e-3),
    log_every=100,
    validate_every=2000,
    checkpoint_every=2000,
)
