"""The words that all rooms share: what is seen, what is wanted, what is done, and by whom.

Batched records are indexed by lane: row e belongs to the episode in lane e, and rows of
lanes that nobody asked for are zeros.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import jax
import numpy as np

Array = np.ndarray | jax.Array


class Observation(NamedTuple):
    """What an agent is shown of B lanes: nothing else reaches the networks."""

    images: Mapping[str, np.ndarray]
    """`[B, H, W, 3]` uint8 from each camera, by its name."""
    q: np.ndarray
    """`[B, d]` [rad]."""
    gripper: np.ndarray
    """`[B]` uint8: 0 open, 1 closed."""


class Subgoal(NamedTuple):
    """What a phase leads to (section 4.2)."""

    q_toggle: Any
    """`[..., d]` where the gripper toggles next [rad]."""
    gripper_toggle: Any
    """`[...]` the gripper's mode after that: 0 open, 1 closed."""
    q_goal: Any
    """`[..., d]` where the arm goes now, on its way there [rad]."""


class Keyframes(NamedTuple):
    """An expert's way to the next toggle: what a subgoal should be."""

    toggle: int
    """Index into `data.TOGGLES` of the toggle that comes next."""
    gripper_toggle: int
    """The gripper's mode after it: 0 open, 1 closed."""
    q: np.ndarray
    """`[K, d]` configurations on the way, the toggle's own last [rad]."""
    error: float
    """Largest pose error that inverse kinematics left [m + rad]."""


class Action(NamedTuple):
    """What the arms in B lanes do until the agent is asked again."""

    q: Sequence[np.ndarray]
    """B arrays `[T, d]`: commands, sampled at the control period [rad]. One row stands still,
    none does nothing at all."""
    gripper: Sequence[np.ndarray]
    """B arrays `[T]`: the gripper's mode from each sample on. Where it changes, the arm stops,
    and the gripper toggles."""
    q_toggle: np.ndarray
    """`[B, d]`: it toggles only where every joint is within `tolerance` of this [rad]."""
    tolerance: float
    """[rad]."""
    settle: float
    """The arm stands still this long at the end of a motion [s]."""
    done: np.ndarray
    """`[B]` bool: after this the episode is over."""
    notes: Mapping[int, dict[str, Any]]
    """What a lane's record should say of it, JSON-ready."""
    decision: Any = None
    """How the agent came to it, for listeners that know the agent."""


class Phase(NamedTuple):
    """A round of the episode loop, as listeners hear of it, before anything moves."""

    number: int
    lanes: list[int]
    """Whose episodes are running."""
    observation: Observation
    action: Action


Listener = Callable[[Phase], None]


class Task(Protocol):
    """A batch of simulated episodes, one a lane."""

    batch: int
    """B, how many lanes there are."""

    def reset(self, lanes: Sequence[int], seeds: Sequence[int]) -> None:
        """Starts an episode in each of some lanes; all about it comes from its seed."""
        ...

    def unfit(self, lane: int) -> str | None:
        """Why an episode that has just begun cannot be asked of anybody, or None."""
        ...

    def observe(self, lanes: Sequence[int]) -> Observation:
        """What an agent is shown."""
        ...

    def execute(self, lanes: Sequence[int], action: Action) -> np.ndarray:
        """Moves arms and toggles grippers; `[B]` bool, which toggled."""
        ...

    def wait(self, lanes: Sequence[int], seconds: float) -> None:
        """Lets time pass [s]."""
        ...

    def failure(self, lane: int) -> str | None:
        """Why an episode that is over is no success, or None: the judge."""
        ...


class Agent(Protocol):
    """Who decides what arms do: the paper's algorithm, an expert, a policy."""

    def reset(self, seeds: Sequence[int]) -> None:
        """Begins an episode in each of the first lanes."""
        ...

    def act(self, number: int, lanes: list[int], observation: Observation) -> Action:
        """What the arms of some lanes do in round `number` of their episodes."""
        ...

    def obstacle(self, lane: int) -> str:
        """Why the last action moved nothing in a lane, for a message."""
        ...
