"""Compilation for programs that run for milliseconds in a test: without optimisation."""

from functools import partial

import jax

from jaxplan.collision import XLA_OPTIONS

QUICK = {**XLA_OPTIONS, "xla_backend_optimization_level": 0}
"""A third of the time that a search takes to compile otherwise."""
jit = partial(jax.jit, compiler_options=QUICK)
