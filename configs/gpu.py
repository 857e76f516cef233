"""The policies of `compact.py` with a GPU's budget: the same networks, more windows a step.

    python -m jaxplan.train diffusion_policy --config configs/gpu.py --data data/mug_timed
    python -m jaxplan.train lstm_gmm --config configs/gpu.py --data data/mug_timed
    python -m jaxplan.train transformer --config configs/gpu.py --data data/mug_timed

All frames lie in the GPU's memory: 5 GB for 1,000 episodes.
"""

import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

from jaxplan.learning import OptimizerConfig

compact = runpy.run_path(str(Path(__file__).with_name("compact.py")))

budget: dict[str, Any] = {
    "steps": 20_000,
    "batch_size": 256,
    "optimizer": OptimizerConfig(learning_rate=1e-3, gradient_clip=10.0),
    "log_every": 200,
    "validate_every": 2000,
    "checkpoint_every": 5000,
}

diffusion_policy = replace(compact["diffusion_policy"], **budget)
# Ten pictures a window instead of two.
lstm_gmm = replace(compact["lstm_gmm"], **budget | {"batch_size": 64})
transformer = replace(compact["transformer"], **budget | {"batch_size": 64})
