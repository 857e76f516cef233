"""A policy as an agent of the episode loop: shown each observation, and asked now and then."""

from collections.abc import Sequence
from typing import Protocol

import jax
import numpy as np

from jaxplan.base import Action, Observation
from jaxplan.episodes import phase_keys
from jaxplan.learning.weights import Weights
from jaxplan.networks import Chunk, Window, decode, row_by_row
from jaxplan.policies.drive import Drive, DrivenTask, Step
from jaxplan.policies.registry import policy_of


class SeenTask(DrivenTask, Protocol):
    """And whose pictures it is shown."""

    name: str
    camera: str


class PolicyAgent:
    """Says a chunk of actions, has the first ones executed, and says the next one.

    Args:
        task: Whose arms it moves.
        weights: Of a policy's network.

    Raises:
        WeightsError: Weights of another task, camera or robot.
    """

    def __init__(self, task: SeenTask, weights: Weights) -> None:
        weights.check_fits(task.name, task.camera, task.robot.name)
        config, policy = weights.config, policy_of(weights.config)
        self.config, self._camera, self._lanes = config, task.camera, task.batch
        self._drive = Drive(task)

        def network(keys: jax.Array, *window: jax.Array) -> Chunk:
            x = policy.act(config, weights.params, Window(*window), keys)
            return decode(config, window[1][:, -1], x)

        # On a CPU an episode is the same whoever runs beside it.
        each = jax.default_backend() == "cpu"
        self.network = jax.jit(row_by_row(network) if each else network)
        self.reset(())

    def reset(self, seeds: Sequence[int]) -> None:
        """Begins a batch of episodes."""
        self._drive.reset()
        self._seeds = np.zeros(self._lanes, np.uint32)
        self._seeds[: len(seeds)] = seeds
        self._window: Window | None = None
        self._chunk: Chunk | None = None

    def act(self, number: int, lanes: list[int], observation: Observation) -> Action:
        """The action of some lanes in round `number`; a round is one action."""
        self._remember(observation)
        at = number % self.config.executed
        if at == 0 or self._chunk is None:
            keys = phase_keys(self._seeds, np.full(self._lanes, number))
            assert self._window is not None
            chunk = self.network(keys, *self._window)
            self._chunk = Chunk(*map(np.asarray, chunk))
        step = Step(*(column[:, at] for column in self._chunk))
        return self._drive.action(lanes, observation, step)

    def obstacle(self, lane: int) -> str:
        """Why an arm stands still."""
        return "the policy stands still"

    def _remember(self, observation: Observation) -> None:
        """The last observations, the first one repeated before the start."""
        image = observation.images[self._camera]
        now = Window(image, observation.q, observation.gripper)
        if self._window is None:
            self._window = Window(
                *(np.repeat(x[:, None], self.config.history, 1) for x in now)
            )
            return
        # Lanes that are not running any more are shown as zeros, and nobody asks about them.
        pairs = zip(self._window, now, strict=True)
        self._window = Window(
            *(np.concatenate([past[:, 1:], x[:, None]], 1) for past, x in pairs)
        )
