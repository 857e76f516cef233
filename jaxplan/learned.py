"""The learned half of Algorithm 1: the upper network and the sampler, ready for the agent."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.base import Observation, Subgoal
from jaxplan.learning.weights import Weights
from jaxplan.networks import Cond, predict, row_by_row
from jaxplan.planning import DrawBank
from jaxplan.samplers import Bank
from jaxplan.tasks import Tabletop


class Upper:
    """The upper network with its weights: Algorithm 1's `predict`, compiled once a batch size.

    Args:
        weights: Of the predictor.
        camera: Whose images it sees.
    """

    def __init__(self, weights: Weights, camera: str) -> None:
        self._camera = camera

        def network(*observations: jax.Array) -> tuple[Subgoal, jax.Array]:
            return predict(weights.config, weights.params, *observations)

        # On a CPU, where it costs a quarter more, an episode is the same whoever runs beside it.
        each = jax.default_backend() == "cpu"
        self.network = jax.jit(row_by_row(network) if each else network)

    def __call__(
        self, observation: Observation, lanes: list[int]
    ) -> tuple[Subgoal, np.ndarray]:
        """Subgoals of some lanes, and the features of all images, `[B, F]`."""
        image = observation.images[self._camera]
        subgoal, features = self.network(image, observation.q, observation.gripper)
        return Subgoal(*map(np.asarray, subgoal)), features

    def features(self, observation: Observation) -> np.ndarray:
        """Of the images alone, `[B, F]`."""
        return self(observation, [])[1]


class LearnedProposals:
    """A bank of trained segments as Algorithm 1's `propose`.

    Args:
        bank: Of segments.
        upper: Whose image features the sampler was trained on.
        camera: Whose images it sees, if it has an encoder of its own.
    """

    def __init__(self, bank: Bank, upper: Upper, camera: str) -> None:
        self.bank, self._upper, self._camera = bank, upper, camera

    def __call__(
        self,
        observation: Observation,
        features: np.ndarray | None,
        subgoal: Subgoal,
        keys: jax.Array,
    ) -> DrawBank:
        """Banks of a phase, under the targets that the planner gets."""
        if self.bank.config.encoder is not None:
            image = observation.images[self._camera]
        else:
            image = self._upper.features(observation) if features is None else features
        cond = Cond(
            image=jnp.asarray(image),
            q=jnp.asarray(observation.q),
            gripper=jnp.asarray(observation.gripper),
            q_toggle=jnp.asarray(subgoal.q_toggle),
            gripper_toggle=jnp.asarray(subgoal.gripper_toggle),
            q_goal=jnp.asarray(subgoal.q_goal),
        )
        return self.bank.of(cond, keys)


class Learned(NamedTuple):
    """Both networks, as Algorithm 1 takes them."""

    predict: Upper
    propose: LearnedProposals


def learned(
    task: Tabletop, weights: tuple[Weights, Weights], inference_steps: int | None = None
) -> Learned:
    """Trained networks for a task.

    Args:
        task: Whose arms are to be moved.
        weights: Predictor, and a sampler that was trained on its features.
        inference_steps: Denoising steps; None takes the sampler's own number.

    Raises:
        WeightsError: Weights of another task, camera or robot.
        ValueError: `inference_steps` for a sampler that has no steps.
    """
    for network in weights:
        network.check_fits(task.name, task.camera, task.robot.name)
    upper = Upper(weights[0], task.camera)
    changes = (
        {} if inference_steps is None else {"num_inference_steps": inference_steps}
    )
    proposals = LearnedProposals(Bank(weights[1], **changes), upper, task.camera)
    return Learned(upper, proposals)
