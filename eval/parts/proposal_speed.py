"""Learned proposals a second: 25 DDIM steps of the U-Net, ours and PyTorch's."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
from peers import absent

from jaxplan.networks import Cond, SamplerConfig, SamplerNetwork
from jaxplan.samplers import draw
from parts.rows import Part, Row, compare
from parts.turns import Side, compiled, take_turns

PART = "proposals"
SCENE = "DDIM-25, U-Net 64/128/256"
ONE, MANY = "jaxplan, 1 a call", "jaxplan, 256 a call"
TORCH = {"PyTorch, 1 a call, one thread": 1, "PyTorch, 1 a call": os.cpu_count() or 1}
"""Threads of each of PyTorch's sides: at this size more of them may cost more than they
give, on a busy machine many times."""
LEAST = 0.7
FEATURES = 64
"""Of the image, which is encoded once a phase, whoever samples."""


def measure(quick: bool, data: Path) -> Part:
    """Both batch sizes; a row that says so where PyTorch is absent."""
    config = SamplerConfig(encoder=None, hidden=(64, 128, 256))
    joints, flag = jnp.zeros((1, len(config.q_min))), jnp.zeros(1)
    cond = Cond(jnp.zeros((1, FEATURES)), joints, flag, joints, flag, joints)
    key_init, key = jax.random.split(jax.random.key(0))
    x_t, t = jnp.zeros((1, len(config.q_min) + 1)), jnp.zeros(1, jnp.int32)
    params = jax.jit(SamplerNetwork(config).init)(key_init, x_t, t, cond)
    sides = []
    for name, count in ((ONE, 1), (MANY, 256)):
        call, seconds = compiled(
            lambda p, c, k, n=count: draw(config, p, c, k, n),
            params,
            cond,
            key[None],
            options={},
        )
        sides.append(Side(name, call, count, seconds))
    reason = absent("torch")
    rows = [Row(PART, SCENE, side, note=reason) for side in TORCH] if reason else []
    if not reason:
        sides += torch_sides(config)
    rounds = 5 if quick else 30
    rows = take_turns(PART, SCENE, "proposals/s", sides, rounds) + rows
    return Part(rows, compare(rows, ONE, LEAST) | compare(rows, MANY, LEAST), {})


def torch_sides(config: SamplerConfig) -> list[Side]:
    """PyTorch's sampler with one thread, and with all."""
    import torch  # pyright: ignore[reportMissingImports]
    from peers.torch_peer import TorchSampler

    sampler = TorchSampler(config).eval()
    vector = torch.zeros(1, config.cond_features)

    def with_threads(threads: int) -> Callable[[], Any]:
        def call() -> Any:
            torch.set_num_threads(threads)
            return sampler.draw(vector)

        return call

    return [Side(name, with_threads(threads), 1) for name, threads in TORCH.items()]
