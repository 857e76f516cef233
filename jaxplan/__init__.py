"""Motion planning in JAX for MuJoCo models, with learned samplers that say where to look."""

__version__ = "0.1.0"
