"""Motion planning in JAX for MuJoCo models, guided by learned samplers."""

__version__ = "0.1.0"
