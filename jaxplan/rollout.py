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

    def reset(self, episodes: Sequence[int], seeds: Sequence[int]) -> None:
        """Starts episodes from seeds."""
        ...

    def in_range(self, episode: int) -> bool:
        """Whether an episode started inside the randomised range."""
        ...

    def observe(self, episodes: Sequence[int]) -> Any:
        """What the networks are shown, one row an episode."""
        ...

    def worlds(self, touching: np.ndarray) -> World:
        """What planning may know, one row a lane; `touching` allows contacts at toggles."""
        ...

    def follow(
        self, episodes: Sequence[int], trajectories: Sequence[np.ndarray]
    ) -> None:
        """Executes joint trajectories."""
        ...

    def toggle(self, episodes: Sequence[int], close: Sequence[bool]) -> None:
        """Toggles grippers, once."""
        ...

    def widen(self, episodes: Sequence[int]) -> None:
        """Opens released grippers all the way."""
        ...

    def wait(self, episodes: Sequence[int], seconds: float) -> None:
        """Lets time pass [s]."""
        ...

    def in_terminal_region(self, episode: int) -> bool:
        """Whether the joints lie in Q_term."""
        ...

    def empty_handed(self, episode: int) -> bool:
        """Whether the gripper has closed on nothing, as its fingers say."""
        ...

    def retreat(self, episode: int) -> np.ndarray:
        """Joints of a hand that has backed off [rad]."""
        ...

    def arrived(self, episode: int, q: np.ndarray, tolerance: float) -> bool:
        """Whether every joint is this near to `q` [rad]."""
        ...

    def failure(self, episode: int) -> str | None:
        """Why a finished episode is no success, or None."""
        ...


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
    last: np.ndarray
    """(B,) bool: the motion ends at a toggle."""
    leaving: list[int]
    """Episodes in the terminal region: they back off, and end."""
    missed: list[int]
    """Episodes whose gripper held nothing: it has opened, they back off, and look again."""
    worlds: World
    """What the search was told of each lane's world."""
    draw: Callable[[jax.Array], Segment] | None
    """The learned sampler with this round's conditions: chunk (B,) -> segments."""
    motion: Motion
    """Rows are lanes: row e belongs to episode e of the batch."""
    executed: list[int]
    """Episodes that will move; the others found no way."""


Predict = Callable[[Any, list[int]], Targets]
"""(observation, episodes) -> targets of these episodes."""
Propose = Callable[[Any, Targets, list[int], jax.Array], Callable[[jax.Array], Segment]]
"""(observation, targets, episodes, keys [P]) -> draw(chunk [P]) -> Segment [P, M]."""
STILL = 0.005
"""A motion in which no joint moves by more [rad] is none."""
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
    task.reset(range(len(seeds)), seeds)
    batch = _Batch(task, seeds)
    for number in range(config.max_phases):
        if not batch.running:
            break
        phase = _plan(batch, number, predict, planner, propose, config)
        if listen is not None:
            listen(phase)
        toggled = _execute(batch, phase, config.toggle_tolerance)
        _record(batch, phase, toggled)
        for e in list(batch.running):
            if e in phase.leaving and e in phase.executed:
                batch.end(e, None)
            elif batch.stuck[e] >= config.max_stuck:
                batch.end(e, _obstacle(planner, phase, e))
    for e in list(batch.running):
        batch.end(e, f"not finished after {config.max_phases} phases")
    return batch.judge()


class _Batch:
    """Who is still running, and how it went so far. An episode's number is its lane."""

    def __init__(self, task: Task, seeds: Sequence[int]) -> None:
        self.task, self.seeds = task, seeds
        self.phases: list[list[PhaseRecord]] = [[] for _ in seeds]
        self.failures: dict[int, str | None] = {}
        self.stuck = np.zeros(task.batch, int)
        """Phases in a row without a motion."""
        self.since_toggle = np.zeros(task.batch, int)
        """Phases since the gripper last toggled."""
        self.touched = np.zeros(task.batch, bool)
        """The last act was a toggle: the next motion leaves what the hand touched."""
        self.running = list(range(len(seeds)))
        for e in list(self.running):
            if not task.in_range(e):
                self.end(e, "the mug came to rest outside the range")

    def end(self, episode: int, failure: str | None) -> None:
        """Takes an episode out of the loop; None leaves the verdict to the judge."""
        self.failures[episode] = failure
        self.running.remove(episode)

    def give_up_grasp(self, episodes: list[int]) -> None:
        """Opens grippers that hold nothing; the next motion leaves what they are at."""
        self.task.toggle(episodes, [False] * len(episodes))
        self.since_toggle[episodes] = 0
        self.touched[episodes] = True

    def judge(self) -> list[EpisodeRecord]:
        """The records of all episodes, once none is running."""
        finished = [e for e, failure in self.failures.items() if failure is None]
        self.task.wait(finished, HOLD)
        for e in finished:
            self.failures[e] = self.task.failure(e)
        return [
            EpisodeRecord(
                int(seed), self.failures[e] is None, self.failures[e], self.phases[e]
            )
            for e, seed in enumerate(self.seeds)
        ]


def _plan(
    batch: _Batch,
    number: int,
    predict: Predict,
    planner: MotionPlanner,
    propose: Propose | None,
    config: RolloutConfig,
) -> Phase:
    """Observes, predicts and plans: lines 3 to 28 of Algorithm 1 for all running episodes."""
    task, running = batch.task, list(batch.running)
    missed = [e for e in running if config.regrasp and task.empty_handed(e)]
    batch.give_up_grasp(missed)
    leaving = [e for e in running if e not in missed and task.in_terminal_region(e)]
    observation = task.observe(running)
    targets = _merge(predict(observation, running), planner, config.merge_distance)
    for row, e in enumerate(running):
        if batch.since_toggle[e] >= config.stall_phases:
            targets.q_goal[row] = targets.q_toggle[row]
    for e in leaving + missed:
        row = running.index(e)
        targets.q_goal[row] = targets.q_toggle[row] = task.retreat(e)
        targets.gripper_toggle[row] = task.closed[e]
    at_toggle = np.all(targets.q_goal == targets.q_toggle, axis=1)
    last = at_toggle & (targets.gripper_toggle != task.closed[running])
    touching = batch.touched.copy()
    touching[running] |= last
    worlds = task.worlds(touching)
    padded = np.zeros(task.batch, np.uint32)
    padded[: len(batch.seeds)] = batch.seeds
    keys = phase_keys(padded, np.full(task.batch, number))
    draw = propose and propose(observation, targets, running, keys)
    # Lanes that are not running are padding, so that nothing recompiles.
    query = np.zeros((3, task.batch, observation.q.shape[1]), np.float32)
    query[:, running] = observation.q, targets.q_goal, targets.q_toggle
    motion = planner.plan(
        worlds,
        q_start=query[0],
        q_goal=query[1],
        q_toggle=query[2],
        keys=keys,
        draw=draw,
        active=np.isin(np.arange(task.batch), running),
        speed=np.where(task.closed, config.carry_speed, 1.0),
    )
    return Phase(
        number=number,
        episodes=running,
        observation=observation,
        targets=targets,
        last=last,
        leaving=leaving,
        missed=missed,
        worlds=worlds,
        draw=draw,
        motion=motion,
        executed=[e for e in running if len(motion.q[e]) > 1],
    )


def _execute(batch: _Batch, phase: Phase, tolerance: float) -> set[int]:
    """Moves, and toggles grippers that have arrived; returns the episodes that toggled."""
    task = batch.task
    task.follow(phase.executed, [phase.motion.q[e] for e in phase.executed])
    task.widen([e for e in phase.executed if batch.touched[e]])
    close = {
        e: bool(phase.targets.gripper_toggle[row])
        for row, e in enumerate(phase.episodes)
        if phase.last[row] and task.arrived(e, phase.targets.q_toggle[row], tolerance)
    }
    task.toggle(list(close), list(close.values()))
    for e in phase.episodes:
        moved = e in phase.executed and np.ptp(phase.motion.q[e], axis=0).max() > STILL
        batch.stuck[e] = 0 if moved or e in close else batch.stuck[e] + 1
        batch.since_toggle[e] = 0 if e in close else batch.since_toggle[e] + 1
        batch.touched[e] = e in close or (batch.touched[e] and not moved)
    return set(close)


def _record(batch: _Batch, phase: Phase, toggled: set[int]) -> None:
    result, targets = phase.motion.result, phase.targets
    for row, e in enumerate(phase.episodes):
        moved = e in phase.executed
        batch.phases[e].append(
            PhaseRecord(
                q_start=phase.observation.q[row].tolist(),
                subgoal=targets.q_goal[row].tolist(),
                q_toggle=targets.q_toggle[row].tolist(),
                gripper_toggle=int(targets.gripper_toggle[row]),
                toggled=e in toggled,
                status=Status(result.status[e]).name,
                expansions=int(result.expansions[e]),
                planning_seconds=phase.motion.seconds / len(phase.episodes),
                smoothing=Rung(phase.motion.rung[e]).name if moved else "NONE",
            )
        )


def _merge(targets: Targets, planner: MotionPlanner, distance: float) -> Targets:
    """Inside the limits; a subgoal next to the toggle becomes the toggle (section 4.2)."""
    low, high = planner.limits.q_min + 1e-3, planner.limits.q_max - 1e-3
    q_toggle = np.clip(targets.q_toggle, low, high).astype(np.float32)
    q_goal = np.clip(targets.q_goal, low, high).astype(np.float32)
    near = np.linalg.norm(q_goal - q_toggle, axis=1) < distance
    q_goal = np.where(near[:, None], q_toggle, q_goal)
    return Targets(q_toggle, np.array(targets.gripper_toggle), q_goal)


def phase_keys(seeds: np.ndarray, numbers: np.ndarray) -> jax.Array:
    """A typed key for each phase [P], from its episode's seed and its number in the episode.

    Whatever runs beside it: search and sampler get the same random numbers again.
    """
    return jax.vmap(
        lambda seed, number: jax.random.fold_in(jax.random.key(seed), number)
    )(seeds.astype(np.uint32), numbers.astype(np.int32))


def _obstacle(planner: MotionPlanner, phase: Phase, episode: int) -> str:
    """Why an episode found no motion: the search's status, and what is in the way."""
    row = phase.episodes.index(episode)
    status = Status(phase.motion.result.status[episode]).name
    if phase.executed.count(episode):
        return f"no motion in phase {phase.number + 1}: the subgoal is where the arm is"
    at_start = planner.reason(phase.worlds, episode, phase.observation.q[row])
    at_goal = planner.reason(phase.worlds, episode, phase.targets.q_goal[row])
    return (
        f"no motion in phase {phase.number + 1}: {status}; "
        f"nearest at its start: {at_start}; at its goal: {at_goal}"
    )
