"""A mixture over whole chunks of actions: a mode is one way to go on, not one step of it.

Joints are Gaussian in each mode, the gripper is a Bernoulli variable in each of its steps: as a
Gaussian its likelihood, of a number that is -1 or 1, would drown that of the joints.
"""

from typing import NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp


class Mixture(NamedTuple):
    """M modes of chunks with T actions."""

    logits: jax.Array
    """[..., M]."""
    mean: jax.Array
    """[..., M, T, d], in [-1, 1]."""
    std: jax.Array
    """[..., M, T, d]."""
    gripper: jax.Array
    """[..., M, T] logits of a closed gripper."""

    def log_prob(self, x: jax.Array) -> jax.Array:
        """Of chunks `x` [..., T, d + 1], whose last number is -1 or 1; [...]."""
        joints, mode = x[..., None, :, :-1], x[..., None, :, -1]
        z = (joints - self.mean) / self.std
        gaussian = -0.5 * z**2 - jnp.log(self.std) - 0.5 * jnp.log(2 * jnp.pi)
        bernoulli = nn.log_sigmoid(mode * self.gripper)
        each = gaussian.sum((-2, -1)) + bernoulli.sum(-1)
        return nn.logsumexp(nn.log_softmax(self.logits) + each, axis=-1)

    def draw(self, key: jax.Array) -> jax.Array:
        """The mean of a mode that is drawn (robomimic's `low_noise_eval`), `[..., T, d + 1]`."""
        mode = jax.random.categorical(key, self.logits)[..., None, None, None]
        mean = jnp.take_along_axis(self.mean, mode, axis=-3)[..., 0, :, :]
        gripper = jnp.take_along_axis(self.gripper, mode[..., 0], axis=-2)[..., 0, :]
        return jnp.concatenate([mean, jnp.sign(gripper)[..., None]], axis=-1)


class MixtureHead(nn.Module):
    """Features to a mixture."""

    modes: int
    horizon: int
    joints: int
    min_std: float

    @nn.compact
    def __call__(self, h: jax.Array) -> Mixture:
        """`h` [..., F]."""
        shape = *h.shape[:-1], self.modes, self.horizon

        def layer(name: str, numbers: int) -> jax.Array:
            return nn.Dense(numbers, name=name)(h)

        each = self.modes * self.horizon
        mean = layer("mean", each * self.joints).reshape(*shape, self.joints)
        std = layer("std", each * self.joints).reshape(*shape, self.joints)
        return Mixture(
            layer("logits", self.modes),
            jnp.tanh(mean),
            nn.softplus(std) + self.min_std,
            layer("gripper", each).reshape(shape),
        )
