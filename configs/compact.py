"""Every network, compact: for two CPU cores.

    python -m jaxplan.train predictor --config configs/compact.py
    python -m jaxplan.train sampler --config configs/compact.py      (then cvae, gan, few_step)

The predictor takes about an hour on one core. Where it differs from the paper: a small ResNet
whose keypoints are read at two scales and laid on the table by the camera's pose; no dropout; an
absolute error (a Huber loss with a small kappa) instead of a square, whose gradient fades before
the joints are exact to a hundredth of a radian.
"""

from typing import Any

from jaxplan.config import (
    CvaeConfig,
    CvaeTraining,
    EncoderConfig,
    FewStepConfig,
    FewStepTraining,
    GanConfig,
    GanTraining,
    HandCameraConfig,
    LossConfig,
    OptimizerConfig,
    PredictorConfig,
    PredictorTraining,
    SamplerConfig,
    SamplerTraining,
)

predictor = PredictorTraining(
    network=PredictorConfig(
        encoder=EncoderConfig(
            stem="patch4",
            width=32,
            blocks=(1, 1, 1),
            scales=2,
            features=128,
            average=True,
        ),
        camera=HandCameraConfig(),
        hidden=512,
        dropout=0.0,
    ),
    loss=LossConfig(huber_kappa=0.01, w_q=40.0, w_s=10.0),
    out="jaxplan/pretrained",
    steps=38_000,
    batch_size=32,
    optimizer=OptimizerConfig(learning_rate=1e-3, warmup_steps=200, gradient_clip=10.0),
    log_every=100,
    validate_every=2000,
    checkpoint_every=1000,
)

common: dict[str, Any] = {
    "out": "jaxplan/pretrained",
    "steps": 10_000,
    "batch_size": 512,
    "log_every": 100,
    "validate_every": 2000,
    "checkpoint_every": 2000,
}
"""The same budget for all learned samplers."""

sampler = SamplerTraining(
    network=SamplerConfig(
        denoiser="film_mlp",
        hidden=(256, 256, 256),
        encoder=None,
        relative=True,
    ),
    optimizer=OptimizerConfig(learning_rate=1e-3),
    **common,
)

cvae = CvaeTraining(
    network=CvaeConfig(latent=8, encoder=None, relative=True),
    kl_weight=1e-2,
    optimizer=OptimizerConfig(learning_rate=1e-3),
    **common,
)

gan = GanTraining(
    network=GanConfig(
        generator=(256, 256, 256),
        discriminator=(256, 256),
        encoder=None,
        relative=True,
    ),
    optimizer=OptimizerConfig(
        learning_rate=5e-4, betas=(0.5, 0.99), gradient_clip=10.0
    ),
    **common,
)

few_step = FewStepTraining(
    network=FewStepConfig(
        denoiser="film_mlp",
        hidden=(256, 256, 256),
        encoder=None,
        relative=True,
    ),
    optimizer=OptimizerConfig(learning_rate=1e-3),
    **(common | {"batch_size": 128}),
)
