"""Algorithm 1's outer loop over a batch of episodes in lockstep.

    observe -> predict -> plan -> smooth -> execute -> toggle, until the terminal region

One predictor call, one sampler call and one planner call a round serve all episodes.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import jax
import numpy as np

from jaxplan.collision import World
from jaxplan.config import RolloutConfig
from jaxplan.motion import Motion, MotionPlanner
from jaxplan.planning import Segment, Status
from jaxplan.trajectory import Rung


class Targets(NamedTuple):
    """What a round plans for, one row an episode."""

    q_toggle: np.ndarray
    """(B, 7) [rad]."""
    gripper_toggle: np.ndarray
    """(B,) 0 open, 1 closed: the mode after the toggle."""
    q_goal: np.ndarray
    """(B, 7) [rad]."""


class Task(Protocol):
    """What a task offers to the loop; `tasks.mug.MugTask` is one."""

    batch: int
    closed: np.ndarray

    def reset(self, episodes: Sequence[int], seeds: Sequence[int]) -> None: ...
    def in_range(self, episode: int) -> bool: ...
    def observe(self, episodes: Sequence[int]) -> Any: ...
    def worlds(self, touching: np.ndarray) -> World: ...
    def follow(
        self, episodes: Sequence[int], trajectories: Sequence[np.ndarray]
    ) -> None: ...
    def toggle(self, episodes: Sequence[int], close: Sequence[bool]) -> None: ...
    def widen(self, episodes: Sequence[int]) -> None: ...
    def wait(self, episodes: Sequence[int], seconds: float) -> None: ...
    def in_terminal_region(self, episode: int) -> bool: ...
    def retreat(self, episode: int) -> np.ndarray: ...
    def arrived(self, episode: int, q: np.ndarray) -> bool: ...
    def failure(self, episode: int) -> str | None: ...


class PhaseRecord(NamedTuple):
    """One planning-execution phase of an episode."""

    q_start: list[float]
    subgoal: list[float]
    q_toggle: list[float]
    gripper_toggle: int
    toggled: bool
    status: str
    expansions: int
    planning_seconds: float
    """The batch's search time divided by the episodes in it [s]."""
    smoothing: str


class EpisodeRecord(NamedTuple):
    """How an episode went."""

    seed: int
    success: bool
    failure: str | None
    phases: list[PhaseRecord]

    @property
    def expansions(self) -> int:
        """Tree expansions over all phases."""
        return sum(phase.expansions for phase in self.phases)

    @property
    def planning_seconds(self) -> float:
        """Search time over all phases [s]."""
        return sum(phase.planning_seconds for phase in self.phases)


class Phase(NamedTuple):
    """What a round hands to a listener, before anything moves."""

    number: int
    episodes: list[int]
    observation: Any
    targets: Targets
    """After merging: where the subgoal is the toggle, they are equal."""
    segments: Segment | None
    motion: Motion
    """Rows are lanes: row e belongs to episode e of the batch."""
    executed: list[int]
    """Episodes that will move; the others found no way."""


Predict = Callable[[Any, list[int]], Targets]
"""(observation, episodes) -> targets of these episodes."""
Propose = Callable[[Any, Targets, list[int], jax.Array], Callable[[jax.Array], Segment]]
"""(observation, targets, episodes, keys [P]) -> draw(chunk [P]) -> Segment [P, M]."""
HOLD = 0.5
"""The judge looks this long after the hand has left [s]."""


def rollout(
    task: Task,
    seeds: Sequence[int],
    predict: Predict,
    planner: MotionPlanner,
    propose: Propose | None = None,
    config: RolloutConfig = RolloutConfig(),
    listen: Callable[[Phase], None] | None = None,
) -> list[EpisodeRecord]:
    """Runs one episode per seed; all of them together are at most `task.batch`.

    Args:
        task: The simulated world.
        seeds: One per episode.
        predict: The upper network, or an expert.
        planner: Search and smoothing.
        propose: The learned sampler; without it all proposals are uniform.
        config: Limits of the loop.
        listen: Called once a round.

    Returns:
        One record per seed, in order.
    """
    lanes = list(range(len(seeds)))
    task.reset(lanes, seeds)
    phases: list[list[PhaseRecord]] = [[] for _ in lanes]
    failures: list[str | None] = [
        None if task.in_range(e) else "the mug came to rest outside the range"
        for e in lanes
    ]
    running = [e for e in lanes if failures[e] is None]
    finished: list[int] = []
    stuck = np.zeros(len(lanes), int)
    touched = np.zeros(task.batch, bool)
    """Episodes whose last act was a toggle: the next motion leaves what the hand touched."""
    for number in range(config.max_phases):
        if not running:
            break
        leaving = [e for e in running if task.in_terminal_region(e)]
        observation = task.observe(running)
        targets = _merge(
            predict(observation, running), planner.limits, config.merge_distance
        )
        for row, e in enumerate(running):
            if e in leaving:
                retreat = task.retreat(e)
                targets.q_goal[row], targets.q_toggle[row] = retreat, retreat
                targets.gripper_toggle[row] = task.closed[e]
        last = np.all(targets.q_goal == targets.q_toggle, axis=1) & (
            targets.gripper_toggle != task.closed[running]
        )
        touching = touched.copy()
        touching[running] |= last
        motion, segments = _plan(
            task,
            planner,
            propose,
            observation,
            targets,
            running,
            touching,
            seeds,
            number,
            config.carry_speed,
        )
        status = motion.result.status
        executed = [e for e in running if len(motion.q[e]) > 1]
        if listen is not None:
            listen(
                Phase(number, running, observation, targets, segments, motion, executed)
            )
        task.follow(executed, [motion.q[e] for e in executed])
        at_toggle = [
            (e, bool(targets.gripper_toggle[row])) for row, e in enumerate(running)
            if last[row] and task.arrived(e, targets.q_toggle[row])
        ]  # fmt: skip
        task.widen([e for e in executed if touched[e]])
        task.toggle([e for e, _ in at_toggle], [close for _, close in at_toggle])
        toggled = {e for e, _ in at_toggle}
        for row, e in enumerate(running):
            moved = e in executed
            stuck[e] = 0 if moved or e in toggled else stuck[e] + 1
            touched[e] = e in toggled or (touched[e] and not moved)
            phases[e].append(PhaseRecord(
                observation.q[row].tolist(), targets.q_goal[row].tolist(), targets.q_toggle[row].tolist(),
                int(targets.gripper_toggle[row]), e in toggled, Status(status[e]).name, int(motion.result.expansions[e]),
                motion.seconds / len(running), Rung(motion.rung[e]).name if moved else "NONE",
            ))  # fmt: skip
        for e in list(running):
            if e in leaving and e in executed:
                finished.append(e)
                running.remove(e)
            elif stuck[e] >= config.max_stuck:
                failures[e] = (
                    f"no motion in phase {number + 1}: {phases[e][-1].status}, "
                    + _obstacle(planner, task, touching, e, phases[e][-1])
                )
                running.remove(e)
    for e in running:
        failures[e] = f"not finished after {config.max_phases} phases"
    task.wait(finished, HOLD)
    for e in finished:
        failures[e] = task.failure(e)
    return [
        EpisodeRecord(int(seeds[e]), failures[e] is None, failures[e], phases[e])
        for e in lanes
    ]


def _obstacle(
    planner: MotionPlanner,
    task: Task,
    touching: np.ndarray,
    episode: int,
    phase: PhaseRecord,
) -> str:
    """What is in the way at the phase's start and goal."""
    worlds = task.worlds(touching)
    at_start = planner.reason(worlds, episode, phase.q_start)
    return f"at its start {at_start}; at its goal {planner.reason(worlds, episode, phase.subgoal)}"


def _merge(targets: Targets, limits, distance: float) -> Targets:
    """Inside the limits; a subgoal next to the toggle becomes the toggle (section 4.2)."""
    q_toggle = np.clip(
        targets.q_toggle, limits.q_min + 1e-3, limits.q_max - 1e-3
    ).astype(np.float32)
    q_goal = np.clip(targets.q_goal, limits.q_min + 1e-3, limits.q_max - 1e-3).astype(
        np.float32
    )
    near = np.linalg.norm(q_goal - q_toggle, axis=1) < distance
    return Targets(
        q_toggle,
        np.array(targets.gripper_toggle),
        np.where(near[:, None], q_toggle, q_goal),
    )


def _plan(
    task,
    planner,
    propose,
    observation,
    targets,
    running,
    touching,
    seeds,
    number,
    carry_speed,
):
    """One batched search; lanes that are not running are padding, so that nothing recompiles."""
    lanes = task.batch
    q_start = np.zeros((lanes, observation.q.shape[1]), np.float32)
    q_goal, q_toggle = q_start.copy(), q_start.copy()
    q_start[running], q_goal[running], q_toggle[running] = (
        observation.q,
        targets.q_goal,
        targets.q_toggle,
    )
    active = np.zeros(lanes, bool)
    active[running] = True
    lane_seeds = np.zeros(lanes, np.uint32)
    lane_seeds[: len(seeds)] = seeds
    keys = jax.vmap(lambda seed: jax.random.fold_in(jax.random.key(seed), number))(
        lane_seeds
    )
    segments = None
    draw = None
    if propose is not None:
        draw_bank = propose(observation, targets, running, keys)

        def draw(chunk):
            nonlocal segments
            bank = draw_bank(chunk)
            segments = bank if segments is None else segments
            return bank

    speed = np.where(task.closed, carry_speed, 1.0)
    worlds = task.worlds(touching)
    return planner.plan(
        worlds, q_start, q_goal, q_toggle, keys, draw, active, speed
    ), segments
