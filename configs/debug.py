"""Tiny networks and a few steps, to see that everything runs.

    python -m jaxplan.train predictor --config configs/debug.py --data DIR
    python -m jaxplan.train sampler --config configs/debug.py --data DIR
    (cvae, gan and few_step likewise, the last one after the sampler)
    python -m jaxplan.train diffusion_policy --config configs/debug.py --data TIMED
    (lstm_gmm and transformer likewise)

Seconds. Expected: the loss falls.
"""

from typing import Any

from jaxplan.learning import OptimizerConfig, PredictorTraining
from jaxplan.networks import (
    CvaeConfig,
    DiffusionPolicyConfig,
    EncoderConfig,
    FewStepConfig,
    GanConfig,
    LstmGmmConfig,
    PredictorConfig,
    SamplerConfig,
    TransformerConfig,
)
from jaxplan.policies import (
    DiffusionPolicyTraining,
    LstmGmmTraining,
    TransformerTraining,
)
from jaxplan.samplers import CvaeTraining, FewStepTraining, GanTraining, SamplerTraining

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

few: dict[str, Any] = {
    "steps": 20,
    "batch_size": 16,
    "optimizer": OptimizerConfig(learning_rate=1e-3),
    "log_every": 5,
    "validate_every": 10,
    "checkpoint_every": 10,
    "val_problems": 4,
    "val_segments": 4,
    "predictor": "runs/debug_predictor/weights",
}

sampler = SamplerTraining(
    name="debug_sampler",
    network=SamplerConfig(
        denoiser="film_mlp", hidden=(32, 32), encoder=None, relative=True
    ),
    **few,
)

few_step = FewStepTraining(
    name="debug_few_step",
    network=FewStepConfig(
        denoiser="film_mlp", hidden=(32, 32), encoder=None, relative=True
    ),
    teacher="runs/debug_sampler/weights",
    **few,
)

cvae = CvaeTraining(
    name="debug_cvae",
    network=CvaeConfig(hidden=(32, 32), encoder=None, relative=True),
    **few,
)

gan = GanTraining(
    name="debug_gan",
    network=GanConfig(
        generator=(32, 32), discriminator=(32, 32), encoder=None, relative=True
    ),
    **few,
)

small: dict[str, Any] = {
    "encoder": EncoderConfig(
        stem="patch4", width=8, blocks=(1, 1), keypoints=8, features=16
    ),
    "hidden": 32,
}
tiny: dict[str, Any] = {
    "steps": 20,
    "batch_size": 8,
    "optimizer": OptimizerConfig(learning_rate=1e-3),
    "log_every": 5,
    "validate_every": 10,
    "checkpoint_every": 10,
    "val_windows": 16,
}

diffusion_policy = DiffusionPolicyTraining(
    name="debug_diffusion_policy",
    network=DiffusionPolicyConfig(widths=(16, 32), kernel=3, cond_features=32, **small),
    **tiny,
)

lstm_gmm = LstmGmmTraining(
    name="debug_lstm_gmm",
    network=LstmGmmConfig(history=3, width=32, observation_features=32, **small),
    **tiny,
)

transformer = TransformerTraining(
    name="debug_transformer",
    network=TransformerConfig(history=3, layers=1, width=32, heads=2, **small),
    **tiny,
)
