"""Tiny networks and a few steps, to see that everything runs.

    python -m jaxplan.train predictor --config configs/debug.py --data DIR
    python -m jaxplan.train sampler --config configs/debug.py --data DIR

Seconds. Expected: the loss falls.
"""

from jaxplan.config import (
    EncoderConfig,
    OptimizerConfig,
    PredictorConfig,
    PredictorTraining,
    SamplerConfig,
    SamplerTraining,
)

predictor = PredictorTraining(
    name="debug_predictor",
    network=PredictorConfig(
        encoder=EncoderConfig(
            stem="patch4", width=8, blocks=(1, 1), keypoints=8, features=16
        ),
        hidden=32,
    ),
    steps=20,
    batch_size=8,
    optimizer=OptimizerConfig(learning_rate=1e-3),
    log_every=5,
    validate_every=10,
    checkpoint_every=10,
)

sampler = SamplerTraining(
    name="debug_sampler",
    predictor="runs/debug_predictor/weights",
    network=SamplerConfig(
        denoiser="film_mlp", hidden=(32, 32), encoder=None, relative=True
    ),
    steps=20,
    batch_size=16,
    optimizer=OptimizerConfig(learning_rate=1e-3),
    log_every=5,
    validate_every=10,
    checkpoint_every=10,
    val_problems=4,
    val_segments=4,
)
