"""Where a number comes from."""

import os
import platform
from importlib.metadata import version

import jax

from jaxplan import __version__

PACKAGES = ("jax", "jaxlib", "flax", "mujoco", "mujoco-mjx", "numpy")


def versions() -> dict[str, str]:
    """Versions of what computes, the platform and the device."""
    device = jax.devices()[0]
    machine = f"{platform.machine()}, {os.cpu_count()} cores"
    return {
        "jaxplan": __version__,
        **{package: version(package) for package in PACKAGES},
        "python": platform.python_version(),
        "machine": f"{machine}, {device.platform}: {device.device_kind}",
    }
