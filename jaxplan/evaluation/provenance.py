"""Where a number comes from."""

import os
import platform
from importlib.metadata import version

import jax

from jaxplan import __version__

PACKAGES = ("jax", "jaxlib", "flax", "mujoco", "mujoco-mjx", "numpy")


def versions() -> dict[str, str]:
    """Versions of what computes, the platform and the device."""
    found = {
        "jaxplan": __version__,
        **{package: version(package) for package in PACKAGES},
    }
    device = jax.devices()[0]
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {device.platform}: {device.device_kind}"
    return {**found, "python": platform.python_version(), "machine": machine}
