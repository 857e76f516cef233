"""Algorithm 1, the paper's agent: predict, merge, plan, smooth; its gripper toggles on arrival.

    observe -> predict -> plan -> smooth -> execute -> toggle, until the terminal region

One predictor call, one sampler call and one planner call a round serve all lanes; where a search
gave up, another follows with other random numbers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import jax
import numpy as np

from jaxplan.base import Action, Observation, Subgoal
from jaxplan.collision import World
from jaxplan.episodes import moves, phase_keys
from jaxplan.motion import Motion, MotionPlanner
from jaxplan.planning import DrawBank, Status
from jaxplan.ranges import Checked, Count, NotNegative, Positive, Whole
from jaxplan.trajectory import Rung

Predict = Callable[[Observation, list[int]], tuple[Subgoal, np.ndarray | None]]
"""Subgoals of some lanes; and image features `[B, F]`, where they came out on the way."""


@dataclass(frozen=True)
class Algorithm1Config(Checked):
    """What the outer loop of Algorithm 1 leaves open."""

    merge_distance: NotNegative = 0.1
    """A predicted subgoal this near to the toggle [rad] becomes the toggle."""
    toggle_tolerance: NotNegative = 0.1
    """The gripper toggles where every joint is this near to q_toggle [rad]: an object that already
    stands on the table may stop the hand a little before it."""
    stall_phases: Whole = 4
    """After so many phases without a toggle the subgoal is the toggle itself."""
    tries: Count = 6
    """Searches of a phase, each with N_rrt expansions and random numbers of its own, before the arm
    goes where the last one came nearest to the goal: from a dead end the networks see what no
    demonstration has shown."""
    carry_speed: Positive = 0.6
    """Factor on velocities (squared: on accelerations) while the gripper is closed."""
    settle: NotNegative = 0.15
    """The arm stands still this long after a motion [s]."""
    regrasp: bool = False
    """A gripper that has closed on nothing opens, backs off and looks again."""


class Propose(Protocol):
    """The learned sampler, ready for a phase."""

    def __call__(
        self,
        observation: Observation,
        features: np.ndarray | None,
        subgoal: Subgoal,
        keys: jax.Array,
    ) -> DrawBank:
        """Segments under these conditions, for typed keys `[B]`."""
        ...


class PlannedTask(Protocol):
    """What the algorithm may know of a task beside its observations."""

    batch: int

    def worlds(self, touching: np.ndarray) -> World:
        """What planning may know, leaves `[B, ...]`; `touching [B]` allows contacts at toggles."""
        ...

    def in_terminal_region(self, lane: int) -> bool:
        """Whether the joints lie in Q_term."""
        ...

    def empty_handed(self, lane: int) -> bool:
        """Whether the gripper has closed on nothing, as its fingers say."""
        ...

    def retreat(self, lane: int) -> np.ndarray:
        """Joints of a hand that has backed off, `[d]` [rad]."""
        ...


class Decision(NamedTuple):
    """How a round's action came about."""

    subgoal: Subgoal
    """After merging: where the subgoal is the toggle, they are equal."""
    at_toggle: np.ndarray
    """`[B]` bool: the motion ends at a toggle."""
    leaving: list[int]
    """Lanes in the terminal region: they back off, and are done."""
    backing: list[int]
    """Lanes whose gripper held nothing: it opens, and in the next round they back off."""
    worlds: World
    """What the search was told of each lane's world."""
    draw: DrawBank | None
    """The learned sampler under this round's conditions."""
    motion: Motion


class Algorithm1:
    """The outer loop's agent. An expert in the networks' place makes demonstrations.

    Args:
        task: Whose arms it moves.
        planner: Search and smoothing.
        predict: The upper network, or an expert.
        propose: The learned sampler; without it all proposals are uniform.
        config: Settings.
    """

    def __init__(
        self,
        task: PlannedTask,
        planner: MotionPlanner,
        predict: Predict,
        propose: Propose | None = None,
        config: Algorithm1Config = Algorithm1Config(),
    ) -> None:
        self.planner, self.predict = planner, predict
        self._task, self._propose, self._config = task, propose, config
        self.reset(())

    def reset(self, seeds: Sequence[int]) -> None:
        """Begins a batch of episodes."""
        lanes = self._task.batch
        self._seeds = np.zeros(lanes, np.uint32)
        self._seeds[: len(seeds)] = seeds
        self._commanded = np.zeros(lanes, np.uint8)
        """Gripper modes during the last motion: another one now says that it toggled."""
        self._moved = np.ones(lanes, bool)
        """Whether the last motion was one."""
        self._since_toggle = np.zeros(lanes, int)
        """Rounds since the gripper last toggled."""
        self._touched = np.zeros(lanes, bool)
        """The last act was a toggle: the next motion leaves what the hand touched."""
        self._gave_up: list[int] = []
        """Lanes that have just opened on nothing."""
        self._last: tuple[Observation, Decision] | None = None

    def act(self, number: int, lanes: list[int], observation: Observation) -> Action:
        """Lines 3 to 28 of Algorithm 1 for some lanes."""
        task, config = self._task, self._config
        if number:
            self._look_back(lanes, observation.gripper)
        empty = [e for e in lanes if config.regrasp and task.empty_handed(e)]
        backing = [e for e in lanes if e in self._gave_up]
        leaving = [e for e in lanes if e not in backing and task.in_terminal_region(e)]
        guess, features = self.predict(observation, lanes)
        subgoal = self._merge(guess, lanes, observation)
        for e in leaving + backing:
            subgoal.q_goal[e] = subgoal.q_toggle[e] = task.retreat(e)
            subgoal.gripper_toggle[e] = observation.gripper[e]
        for e in empty:
            subgoal.q_goal[e] = subgoal.q_toggle[e] = observation.q[e]
            subgoal.gripper_toggle[e] = 0
        running = np.isin(np.arange(task.batch), lanes)
        at_toggle = np.all(subgoal.q_goal == subgoal.q_toggle, axis=1)
        at_toggle &= running & (subgoal.gripper_toggle != observation.gripper)
        worlds = task.worlds(self._touched | at_toggle)
        running[empty] = False
        keys = phase_keys(self._seeds, np.full(task.batch, number))

        def search(
            keys: jax.Array, active: np.ndarray
        ) -> tuple[DrawBank | None, Motion]:
            draw = None
            if self._propose is not None:
                draw = self._propose(observation, features, subgoal, keys)
            return draw, self.planner.plan(
                worlds,
                q_start=observation.q,
                q_goal=subgoal.q_goal,
                q_toggle=subgoal.q_toggle,
                keys=keys,
                draw=draw,
                active=active,
                speed=np.where(observation.gripper, config.carry_speed, 1.0),
            )

        draw, motion = search(keys, running)
        for attempt in range(1, config.tries):
            open_ = running & (motion.result.status == Status.BUDGET_EXHAUSTED)
            if not open_.any():
                break
            others = jax.vmap(lambda key, n=attempt: jax.random.fold_in(key, n))(keys)
            motion = motion.then(search(others, open_)[1], open_)
        self._gave_up = empty
        decision = Decision(
            subgoal, at_toggle, leaving, empty + backing, worlds, draw, motion
        )
        self._last = observation, decision
        return self._action(lanes, observation, decision)

    def obstacle(self, lane: int) -> str:
        """Why the last round found no motion: the search's status, and what is in the way."""
        assert self._last is not None
        observation, decision = self._last
        if len(decision.motion.q[lane]) > 1:
            return "the subgoal is where the arm is"
        status = Status(decision.motion.result.status[lane]).name
        at_start, at_goal = (
            self.planner.reason(decision.worlds, lane, q[lane])
            for q in (observation.q, decision.subgoal.q_goal)
        )
        return f"{status}; nearest at its start: {at_start}; at its goal: {at_goal}"

    def _look_back(self, lanes: list[int], gripper: np.ndarray) -> None:
        """What came of the last action, as far as joints and gripper tell."""
        toggled, moved = gripper != self._commanded, self._moved
        for e in lanes:
            self._since_toggle[e] = 0 if toggled[e] else self._since_toggle[e] + 1
            self._touched[e] = toggled[e] or (self._touched[e] and not moved[e])

    def _merge(
        self, guess: Subgoal, lanes: list[int], observation: Observation
    ) -> Subgoal:
        """Inside the limits; a subgoal next to the toggle becomes the toggle (section 4.2).

        So does that of a lane which has not toggled for long.
        """
        config, limits = self._config, self.planner.limits
        low, high = limits.q_min + 1e-3, limits.q_max - 1e-3
        q_toggle = np.zeros_like(observation.q)
        q_goal = np.zeros_like(observation.q)
        gripper_toggle = np.zeros(len(q_goal), np.int32)
        q_toggle[lanes] = np.clip(guess.q_toggle[lanes], low, high)
        q_goal[lanes] = np.clip(guess.q_goal[lanes], low, high)
        gripper_toggle[lanes] = guess.gripper_toggle[lanes]
        near = np.linalg.norm(q_goal - q_toggle, axis=1) < config.merge_distance
        late = self._since_toggle >= config.stall_phases
        q_goal = np.where((near | late)[:, None], q_toggle, q_goal)
        return Subgoal(q_toggle, gripper_toggle, q_goal)

    def _action(
        self, lanes: list[int], observation: Observation, decision: Decision
    ) -> Action:
        """The motions as an action; one that ends at a toggle changes the gripper's mode there."""
        motion, subgoal = decision.motion, decision.subgoal
        self._commanded = observation.gripper.copy()
        self._moved = np.array([moves(way) for way in motion.q])
        q: list[np.ndarray] = []
        gripper: list[np.ndarray] = []
        for e, way in enumerate(motion.q):
            if decision.at_toggle[e] and len(way) < 2:
                way = observation.q[e : e + 1]  # no motion, but it may be there already
            mode = np.full(len(way), observation.gripper[e], np.uint8)
            if decision.at_toggle[e]:
                mode[-1] = subgoal.gripper_toggle[e]
            q.append(way)
            gripper.append(mode)
        done = np.zeros(len(q), bool)
        done[[e for e in decision.leaving if len(motion.q[e]) > 1]] = True
        return Action(
            q=q,
            gripper=gripper,
            q_toggle=subgoal.q_toggle,
            tolerance=self._config.toggle_tolerance,
            settle=self._config.settle,
            done=done,
            notes={e: self._note(e, len(lanes), observation, decision) for e in lanes},
            decision=decision,
        )

    def _note(
        self, lane: int, running: int, observation: Observation, decision: Decision
    ) -> dict[str, Any]:
        """What an episode's record says of a phase."""
        subgoal, motion = decision.subgoal, decision.motion
        result, found = motion.result, len(motion.q[lane]) > 1
        return {
            "q_start": observation.q[lane].tolist(),
            "subgoal": subgoal.q_goal[lane].tolist(),
            "q_toggle": subgoal.q_toggle[lane].tolist(),
            "gripper_toggle": int(subgoal.gripper_toggle[lane]),
            "status": Status(result.status[lane]).name,
            "expansions": int(result.expansions[lane]),
            # The batch's search time divided by the episodes in it [s].
            "planning_seconds": motion.seconds / running,
            "smoothing": Rung(motion.rung[lane]).name if found else "NONE",
        }
