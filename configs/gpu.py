"""What a GPU trains in minutes: the predictor of both scenes, and the policies.

train/README.md has the predictor's commands. Its encoder is three times the compact one: two blocks
a stage, and keypoints at the finest stage too. On a CPU a prediction takes 6 ms instead of 2.4,
and training 3 times as long. From 1,168 episodes of varied pictures, 80 s on one H100: held-out
toggle error 0.045 rad in the mean. 15,000 steps more brought 0.034 (0.031 with twice the
channels), the last 5,000 nothing: by then the training loss was a tenth of what it had been.
Episodes are missing.

The policies are twice as wide as those of `compact.py`, with more windows a step; all frames lie in
the GPU's memory, 5 GB for 1,000 episodes. They were not trained to their end yet.

    python -m jaxplan.train diffusion_policy --config configs/gpu.py --data data/timed_camera

The samplers need no GPU: `compact.py` has them.
"""

import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

from jaxplan.learning import OptimizerConfig

compact = runpy.run_path(str(Path(__file__).with_name("compact.py")))

network = compact["predictor"].network
encoder = replace(network.encoder, blocks=(2, 2, 2), scales=3)
predictor = replace(
    compact["predictor"],
    network=replace(network, encoder=encoder),
    batch_size=128,
    steps=6500,
)

budget: dict[str, Any] = {
    "steps": 20_000,
    "optimizer": OptimizerConfig(learning_rate=1e-3, gradient_clip=10.0),
    "log_every": 200,
    "validate_every": 2000,
    "checkpoint_every": 5000,
}


def larger(kind: str, batch_size: int, **sizes: Any) -> Any:
    """A compact policy with other sizes of its own, trained for longer."""
    smaller = compact[kind]
    network = replace(smaller.network, **sizes)
    return replace(smaller, network=network, **budget, batch_size=batch_size)


diffusion_policy = larger("diffusion_policy", 256, widths=(64, 128, 256))
# Ten pictures a window instead of two.
lstm_gmm = larger("lstm_gmm", 64, width=400)
transformer = larger("transformer", 64, layers=4, width=256)
