"""The shipped predictor, of both scenes. For a GPU.

    python -m jaxplan.train predictor --config configs/gpu.py --data data/mug_camera data/mug_all \
        data/cluttered_camera data/cluttered_all

Three times the compact encoder: two blocks a stage, and keypoints at the finest stage too. On a
CPU a prediction takes 6 ms instead of 2.4, but training 3 times as long. The samplers need no
GPU: `compact.py` has them.
"""

import runpy
from dataclasses import replace
from pathlib import Path

from jaxplan.learning import PredictorTraining

compact: PredictorTraining = runpy.run_path(
    str(Path(__file__).with_name("compact.py"))
)["predictor"]
predictor = replace(
    compact,
    network=replace(
        compact.network,
        encoder=replace(compact.network.encoder, blocks=(2, 2, 2), scales=3),
    ),
    batch_size=128,
    steps=20_000,
    validate_every=5000,
    checkpoint_every=5000,
)
