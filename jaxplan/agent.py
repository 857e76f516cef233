"""The learned half of Algorithm 1: the upper network and the sampler, ready for the outer loop."""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import samplers
from jaxplan.config import SamplerConfig
from jaxplan.learning import Weights
from jaxplan.motion import jit
from jaxplan.networks import Cond, predict
from jaxplan.planning import Segment
from jaxplan.rollout import Targets

BANK = 32
"""Learned segments drawn at a time for a phase; a search that uses them up gets as many more."""


class Upper:
    """The upper network with its weights, for batches of one size; the others are padded.

    Args:
        predictor: Weights.
        batch: Lanes of the outer loop.
    """

    def __init__(self, predictor: Weights, batch: int) -> None:
        self._batch = batch
        self._images = np.zeros((batch, 0, 0, 0), np.uint8)
        self._features = np.zeros((batch, 0), np.float32)

        @jax.jit
        def network(image, q, gripper):
            return predict(predictor.config, predictor.params, image, q, gripper)

        self.network = network

    def __call__(self, observation, episodes: list[int]) -> Targets:
        """Targets of the observed episodes: the outer loop's `predict`."""
        padded = [pad(column, episodes, self._batch) for column in observation]
        subgoal, self._features = self.network(*padded)
        self._images = padded[0]
        rows = (subgoal.q_toggle, subgoal.gripper_toggle, subgoal.q_goal)
        return Targets(*(np.asarray(column)[episodes] for column in rows))

    def features(self, observation, episodes: list[int]) -> np.ndarray:
        """`[B, F]` of the images of the observed episodes, for a sampler without an encoder.

        Those of the last call, if it saw these images; targets may have come from elsewhere.
        """
        if not np.array_equal(self._images[episodes], observation.image):
            self(observation, episodes)
        return self._features


class Agent:
    """Predictor and sampler with their weights, for batches of one size.

    Each network compiles once: batches that are short of episodes are padded.

    Args:
        predictor: Weights of the upper network.
        sampler: Weights of the sampler that was trained on its features.
        batch: Lanes of the outer loop.
        inference_steps: Denoising steps; None takes the sampler's own number.

    Raises:
        ValueError: `inference_steps` for a sampler that has no steps.
    """

    def __init__(
        self,
        predictor: Weights,
        sampler: Weights,
        batch: int,
        inference_steps: int | None = None,
    ) -> None:
        self.batch = batch
        self.predict = Upper(predictor, batch)
        config = sampler.config
        if inference_steps is not None:
            if not isinstance(config, SamplerConfig):
                raise ValueError(
                    f"inference_steps {inference_steps}: {type(config).__name__} has none"
                )
            config = dataclasses.replace(config, num_inference_steps=inference_steps)
        self._own_encoder = config.encoder is not None

        @jit
        def segments(cond, keys, chunk):
            params = sampler.params
            return samplers.draw_chunk(config, params, cond, keys, chunk, BANK)

        self.segments = segments

    def propose(
        self, observation, targets: Targets, episodes: list[int], keys: jax.Array
    ) -> Callable[[jax.Array], Segment]:
        """Learned segments of a phase: the outer loop's `propose`.

        The condition holds the targets that the planner got, after merging.
        """
        image, q, gripper, *aims = (
            pad(column, episodes, self.batch) for column in (*observation, *targets)
        )
        targets = Targets(*aims)
        if not self._own_encoder:
            image = self.predict.features(observation, episodes)
        cond = Cond(
            image=jnp.asarray(image),
            q=jnp.asarray(q),
            gripper=jnp.asarray(gripper),
            q_toggle=jnp.asarray(targets.q_toggle),
            gripper_toggle=jnp.asarray(targets.gripper_toggle),
            q_goal=jnp.asarray(targets.q_goal),
        )
        return lambda chunk: self.segments(cond, keys, jnp.asarray(chunk))


def pad(column: np.ndarray, episodes: list[int], batch: int) -> np.ndarray:
    """Rows of some episodes at their lanes, zeros elsewhere."""
    padded = np.zeros((batch, *column.shape[1:]), column.dtype)
    padded[episodes] = column
    return padded
