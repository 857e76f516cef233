"""Data-parallel training: every device holds the weights and takes its part of each batch.

The step itself is written for one device; `jax.jit` splits it along the arrays' shardings and
adds up the gradients.
"""

from typing import Any

import jax
from jax.sharding import Mesh, NamedSharding, PartitionSpec


class Devices:
    """All devices that JAX sees, in a line."""

    def __init__(self) -> None:
        devices = jax.devices()
        self.count = len(devices)
        mesh = Mesh(devices, ("batch",))
        self._whole = NamedSharding(mesh, PartitionSpec())
        self._part = NamedSharding(mesh, PartitionSpec("batch"))

    def replicate(self, tree: Any) -> Any:
        """The same arrays on every device."""
        return jax.device_put(tree, self._whole)

    def split(self, batch: Any) -> Any:
        """Arrays [B, ...] by their first axis."""
        return jax.device_put(batch, self._part)
