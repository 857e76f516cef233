"""Episodes in lockstep: observe, act, execute, until the task is done or nothing moves.

The loop knows neither planner nor network: an `Agent` decides, a `Task` is the world.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxplan.base import Agent, Listener, Phase, Task
from jaxplan.ranges import Checked, Count, Whole

STILL = 0.005
"""A motion in which no joint moves by more [rad] is none."""
HOLD = 0.5
"""The judge looks this long after the episode is over [s]."""


@dataclass(frozen=True)
class EpisodeConfig(Checked):
    """When an episode is given up."""

    max_phases: Count = 24
    max_stuck: Whole = 2
    """Phases in a row without a motion."""


class EpisodeRecord(NamedTuple):
    """How an episode went."""

    seed: int
    success: bool
    failure: str | None
    phases: list[dict[str, Any]]
    """The agent's notes of each round, and whether the gripper `toggled`."""

    @property
    def expansions(self) -> int:
        """Tree expansions over all phases."""
        return sum(phase.get("expansions", 0) for phase in self.phases)

    @property
    def planning_seconds(self) -> float:
        """Search time over all phases [s]."""
        return sum(phase.get("planning_seconds", 0.0) for phase in self.phases)

    def as_json(self) -> dict[str, Any]:
        """JSON-ready."""
        sums = {
            "expansions": self.expansions,
            "planning_seconds": self.planning_seconds,
        }
        return self._asdict() | sums


def run_episodes(
    task: Task,
    agent: Agent,
    seeds: Sequence[int],
    config: EpisodeConfig = EpisodeConfig(),
    listeners: Sequence[Listener] = (),
) -> list[EpisodeRecord]:
    """Runs one episode a seed, `task.batch` of them side by side.

    Args:
        task: The simulated world.
        agent: Who acts.
        seeds: One an episode.
        config: When to stop.
        listeners: Each is called once a round, before anything moves.

    Returns:
        One record a seed, in order.
    """
    records = []
    for first in range(0, len(seeds), task.batch):
        part = seeds[first : first + task.batch]
        records += _run_batch(task, agent, part, config, listeners)
    return records


def moves(q: np.ndarray) -> bool:
    """Whether commands `[T, d]` [rad] are a motion at all."""
    return len(q) > 1 and bool(np.ptp(q, axis=0).max() > STILL)


def phase_keys(seeds: np.ndarray, numbers: np.ndarray) -> jax.Array:
    """A typed key for each phase `[P]`, from its episode's seed and its number in the episode.

    Whatever runs beside it: search and sampler get the same random numbers again.
    """
    return jax.vmap(
        lambda seed, number: jax.random.fold_in(jax.random.key(seed), number)
    )(seeds.astype(np.uint32), numbers.astype(np.int32))


def _run_batch(
    task: Task,
    agent: Agent,
    seeds: Sequence[int],
    config: EpisodeConfig,
    listeners: Sequence[Listener],
) -> list[EpisodeRecord]:
    """Episodes that have a lane each."""
    lanes = list(range(len(seeds)))
    task.reset(lanes, seeds)
    agent.reset(seeds)
    notes: list[list[dict[str, Any]]] = [[] for _ in seeds]
    failures = {e: why for e in lanes if (why := task.unfit(e)) is not None}
    over: list[int] = []
    stuck = np.zeros(task.batch, int)
    for number in range(config.max_phases):
        running = [e for e in lanes if e not in failures and e not in over]
        if not running:
            break
        observation = task.observe(running)
        action = agent.act(number, running, observation)
        phase = Phase(number, running, observation, action)
        for listen in listeners:
            listen(phase)
        toggled = task.execute(running, action)
        for e in running:
            notes[e].append(action.notes[e] | {"toggled": bool(toggled[e])})
            stuck[e] = 0 if moves(action.q[e]) or toggled[e] else stuck[e] + 1
            if action.done[e]:
                over.append(e)
            elif stuck[e] >= config.max_stuck:
                why = agent.obstacle(e)
                failures[e] = f"no motion in phase {number + 1}: {why}"
    task.wait(over, HOLD)
    failures |= {e: why for e in over if (why := task.failure(e)) is not None}
    late = f"not finished after {config.max_phases} phases"
    failures |= {e: late for e in lanes if e not in failures and e not in over}
    return [
        EpisodeRecord(int(seed), e not in failures, failures.get(e), notes[e])
        for e, seed in enumerate(seeds)
    ]
