"""Compilation for programs that run for milliseconds in a test: without optimisation."""

from functools import partial

import jax

from jaxplan.collision import XLA_OPTIONS

jit = partial(
    jax.jit, compiler_options={**XLA_OPTIONS, "xla_backend_optimization_level": 0}
)
"""A search compiles in a third of the time, and the sums are the same."""
