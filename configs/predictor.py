"""The upper network, compact: for two CPU cores.

    python -m jaxplan.train predictor --config configs/predictor.py

About 33 minutes on two cores. Toggle error on held-out episodes of 1,536 demonstrations: median
0.034 rad, mean 0.042 (L2 over the joints); it was still falling, so more steps would help.
"""

from jaxplan.config import (
    EncoderConfig,
    OptimizerConfig,
    PredictorConfig,
    PredictorTraining,
)

predictor = PredictorTraining(
    network=PredictorConfig(
        encoder=EncoderConfig(
            stem="patch4",
            width=32,
            blocks=(1, 1, 1),
            last_strides=(2, 1),
            features=128,
            average=True,
        ),
        dropout=0.02,
    ),
    out="jaxplan/pretrained",
    steps=8000,
    batch_size=64,
    optimizer=OptimizerConfig(learning_rate=1e-3, warmup_steps=200),
    validate_every=500,
    checkpoint_every=500,
)
