"""A training of one weight, in no time."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import learning
from jaxplan.learning import OptimizerConfig, PredictorTraining


def toy(config, run, poison: int | None = None, stop: int | None = None, origin=None):
    """Fits a line; `stop` kills the run after so many batches."""
    seen = []

    def gather(rows):
        if stop is not None and len(seen) == stop:
            raise KeyboardInterrupt
        seen.append(rows)
        bad = poison is not None and len(seen) > poison
        return jnp.asarray(rows * (np.nan if bad else 0.01), jnp.float32)

    def loss(params, key, batch):
        noisy = batch + 0.01 * jax.random.normal(key, batch.shape)
        return jnp.mean((params["w"] * noisy - 2.0 * batch) ** 2), {}

    def validate(params):
        return {"w": float(params["w"])}

    params = {"w": jnp.zeros(())}
    rows = np.arange(64)
    return learning.fit(config, run, params, loss, rows, gather, validate, origin or {})


TOY = PredictorTraining(
    name="toy",
    steps=30,
    batch_size=8,
    log_every=5,
    validate_every=15,
    checkpoint_every=10,
    optimizer=OptimizerConfig(learning_rate=0.1, warmup_steps=2),
)
