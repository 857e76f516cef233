"""The planner as a library: questions about one robot in, certified and timed motions out.

    scene = jaxplan.Scene.from_mjcf("robot.xml")
    planner = jaxplan.Planner(scene)
    plan = planner.plan(q_start, q_goal)
    planner.certify(plan), planner.time(plan)

Statuses say what came of a question; exceptions say that it was none.
"""

import dataclasses
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from jaxplan import collision
from jaxplan.collision import Certificate, World, make_world
from jaxplan.config import PlannerConfig, TrajectoryConfig
from jaxplan.planning import PlanResult, Segment, Status, make_planner
from jaxplan.scene import Scene
from jaxplan.trajectory import Rung, make_trajectory

Sampler = Callable[[jax.Array, jax.Array, jax.Array, int], Segment]
"""`(key, q_start [d], q_goal [d], count) -> Segment [count]`: tree-extension segments for a
problem, traced by JAX."""

BANK = 64
"""Segments that a sampler is asked for at a time."""
UNLIMITED = {"hinge": 2 * np.pi, "slide": 10.0}
"""How far from 0 a joint without limits is searched [rad or m]."""


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """The answer to one question."""

    status: Status
    path: np.ndarray
    """`[n, d]` waypoints from q_start to q_goal [rad]; where the budget was exhausted, to the
    node nearest to the goal; without rows where nothing was searched."""
    expansions: int
    checks: int
    """Configurations of motions that were checked."""
    time: float
    """Wall time of the search [s]; in a batch, of the whole batch."""
    reason: str
    """Why there is no path, in a line; empty where there is one."""
    seed: int
    world: World

    @property
    def solved(self) -> bool:
        """Whether the path leads to the goal."""
        return self.status == Status.SOLVED

    @property
    def length(self) -> float:
        """Of the path, in joint space [rad]."""
        return float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())


class Timed(NamedTuple):
    """A motion from rest to rest, sampled at the control period."""

    t: np.ndarray
    """`[T]` [s], from 0."""
    q: np.ndarray
    """`[T, d]` [rad]."""
    qd: np.ndarray
    """`[T, d]` [rad/s]."""
    qdd: np.ndarray
    """`[T, d]` [rad/s^2]; the one that holds from each sample on."""
    free: bool
    """Every sample is; false only if the world has changed since the plan was made."""


class Planner:
    """Plans motions of one arm.

    Everything compiles once, at the first question of its kind; a `World` that changes from
    question to question compiles nothing anew.

    Args:
        scene: What can touch what.
        config: Settings of the search.
        trajectory: Settings of smoothing and timing.
        sampler: Proposes segments; without it all proposals are uniform.
        velocity: Of each joint at most, or `[d]` [rad/s or m/s].
        acceleration: Of each joint at most, or `[d]` [rad/s^2 or m/s^2].
        q_min: `[d]` lower joint limits; the model's where None.
        q_max: `[d]` upper joint limits; the model's where None.

    Raises:
        ValueError: A setting that makes no sense.
    """

    def __init__(
        self,
        scene: Scene,
        config: PlannerConfig = PlannerConfig(),
        trajectory: TrajectoryConfig = TrajectoryConfig(),
        sampler: Sampler | None = None,
        velocity: ArrayLike = 1.0,
        acceleration: ArrayLike = 2.0,
        q_min: ArrayLike | None = None,
        q_max: ArrayLike | None = None,
    ) -> None:
        self.scene, self.config = scene, config
        self._trajectory, self._sampler = trajectory, sampler
        d = len(scene.joints)
        self._velocity = _most(velocity, d, "velocity")
        self._acceleration = _most(acceleration, d, "acceleration")
        far = np.array([UNLIMITED[scene.joint_kind(name)] for name in scene.joints])
        self.q_min, self.q_max = (
            np.clip(np.asarray(own if given is None else given, float), -far, far)
            for own, given in ((scene.q_min, q_min), (scene.q_max, q_max))
        )
        self._searches: dict[bool, Callable[..., PlanResult]] = {}

    @cached_property
    def empty_world(self) -> World:
        """The world as the model has it, without obstacles in its slots."""
        return make_world(self.scene)

    def plan(
        self,
        q_start: ArrayLike,
        q_goal: ArrayLike,
        seed: int = 0,
        world: World | None = None,
    ) -> Plan:
        """Finds a collision-free path.

        The same question with the same seed has the same answer, alone or in a batch.

        Args:
            q_start: `[d]` [rad].
            q_goal: `[d]` [rad].
            seed: At least 0.
            world: Where things are, see `collision.make_world`; the model's where None.

        Raises:
            ValueError: An argument of the wrong shape or type.
        """
        start = _rows(q_start, 1, self, "q_start")[None]
        goal = _rows(q_goal, 1, self, "q_goal")[None]
        return self._plan(start, goal, [seed], world)[0]

    def plan_batch(
        self,
        q_starts: ArrayLike,
        q_goals: ArrayLike,
        seeds: Sequence[int] | None = None,
        worlds: World | Sequence[World] | None = None,
    ) -> list[Plan]:
        """Answers P questions in one call.

        Args:
            q_starts: `[P, d]` [rad].
            q_goals: `[P, d]` [rad].
            seeds: P, each at least 0; 0 to P - 1 where None.
            worlds: One for all, one for each, or one whose leaves have a leading axis P.

        Raises:
            ValueError: An argument of the wrong shape or type.
        """
        q_starts, q_goals = (
            _rows(q, 2, self, n)
            for q, n in ((q_starts, "q_starts"), (q_goals, "q_goals"))
        )
        seeds = list(range(len(q_starts))) if seeds is None else list(seeds)
        if not len(q_starts) == len(q_goals) == len(seeds):
            sizes = f"{len(q_starts)}, {len(q_goals)} and {len(seeds)}"
            raise ValueError(f"q_starts, q_goals and seeds have {sizes} rows")
        if worlds is None or isinstance(worlds, World):
            return self._plan(q_starts, q_goals, seeds, worlds)
        rows = [self._checked(world, ()) for world in worlds]
        if len(rows) != len(seeds):
            raise ValueError(f"{len(rows)} worlds for {len(seeds)} questions")
        stacked = (
            jax.tree.map(lambda *leaves: np.stack(leaves), *rows) if rows else None
        )
        return self._plan(q_starts, q_goals, seeds, stacked)

    def time(self, plan: Plan, speed: float = 1.0) -> Timed:
        """Shortens, smooths and times a path (section 4.3), and checks all of it again.

        Args:
            plan: A solved one.
            speed: Factor on the velocity limits, its square on the accelerations.

        Raises:
            ValueError: The plan has no path to its goal.
        """
        if not plan.solved:
            raise ValueError(f"no motion to time: {plan.reason}")
        if not 0 < speed < np.inf:
            raise ValueError(f"speed {speed}, expected more than 0")
        timed = make_trajectory(
            plan.path[None],
            np.array([len(plan.path)]),
            jax.random.key(plan.seed)[None],
            lambda problem, q: self._free(plan.world, q),
            speed * self._velocity,
            speed**2 * self._acceleration,
            self._trajectory,
        )
        q, qd, qdd = (x[0, : timed.length[0]] for x in (timed.q, timed.qd, timed.qdd))
        free = bool(timed.rung[0] != Rung.INVALID)
        return Timed(timed.times[: timed.length[0]], q, qd, qdd, free)

    def certify(
        self,
        plan: Plan | ArrayLike,
        world: World | None = None,
        resolution: float = 0.01,
        tolerance: float = 0.001,
    ) -> Certificate:
        """What C MuJoCo, which had no part in it, says about a path; see `collision.certify`.

        Args:
            plan: A plan, or waypoints `[n, d]` [rad].
            world: The plan's own where None.
            resolution: Longest gap between checked configurations [rad].
            tolerance: Penetration that still passes [m].
        """
        path = plan.path if isinstance(plan, Plan) else np.asarray(plan, float)
        own = plan.world if isinstance(plan, Plan) else self.empty_world
        world = own if world is None else world
        return collision.certify(self.scene, world, path, resolution, tolerance)

    def clearance(self, qs: ArrayLike, world: World | None = None) -> np.ndarray:
        """Least signed distance over all pairs that count `[...]` [m], negative = penetration.

        Args:
            qs: `[..., d]` [rad].
            world: The model's own where None.
        """
        q = np.asarray(qs, np.float32)
        if q.ndim < 1 or q.shape[-1] != len(self.scene.joints):
            joints = len(self.scene.joints)
            raise ValueError(f"qs has shape {q.shape}, expected (..., {joints})")
        world = self.empty_world if world is None else world
        return np.asarray(self._clearance(world, q))

    @cached_property
    def _clearance(self) -> Callable:
        return _jit(lambda world, q: collision.clearance(self.scene, world, q))

    @cached_property
    def _free(self) -> Callable:
        margin = self.config.margin
        return _jit(
            lambda world, q: collision.config_free(self.scene, world, q, margin)
        )

    def _plan(
        self,
        q_start: np.ndarray,
        q_goal: np.ndarray,
        seeds: Sequence[int],
        world: World | None,
    ) -> list[Plan]:
        """Plans for rows `[P, d]`; leaves of the world have a leading axis or none."""
        count = len(seeds)
        for seed in seeds:
            if not (isinstance(seed, int | np.integer) and 0 <= seed < 2**32):
                raise ValueError(
                    f"seed {seed!r}, expected an integer from 0 to 2^32 - 1"
                )
        empty = self.empty_world
        world = self._checked(empty if world is None else world, (count,))
        own = bool(world.passive.ndim > empty.passive.ndim)
        if not count:
            return []
        began = time.perf_counter()
        parts = _parts(count)
        search = partial(self._search_rows, q_start, q_goal, seeds, world, own)
        if len(parts) == 1:
            answers = [search(parts[0])]
        else:
            with ThreadPoolExecutor(len(parts)) as pool:
                answers = list(pool.map(search, parts))
        seconds = time.perf_counter() - began
        plans: dict[int, Plan] = {}
        for rows, answer in zip(parts, answers, strict=True):
            for place, row in enumerate(rows):
                here = (
                    jax.tree.map(lambda leaf, r=row: leaf[r], world) if own else world
                )
                length = int(answer.path_length[place])
                plan = Plan(
                    status=Status(int(answer.status[place])),
                    path=np.asarray(answer.path[place, :length]),
                    expansions=int(answer.expansions[place]),
                    checks=int(answer.checks[place]),
                    time=seconds,
                    reason="",
                    seed=seeds[row],
                    world=here,
                )
                reason = self._reason(plan, q_start[row], q_goal[row])
                plans[row] = dataclasses.replace(plan, reason=reason)
        return [plans[row] for row in range(count)]

    def _checked(self, world: World, batch: tuple[int, ...]) -> World:
        """The world in NumPy; all of its leaves have leading axes `batch`, or none has any."""
        if not isinstance(world, World):
            raise ValueError(f"{type(world).__name__} is not a World, see make_world")
        leaves: list[Any] = []
        ours = self.empty_world
        for name, leaf, own in zip(World._fields, world, ours, strict=True):
            try:
                leaves.append(np.asarray(leaf, own.dtype))
            except (TypeError, ValueError, OverflowError) as error:
                raise ValueError(f"world.{name} is not an array: {error}") from None
            if leaves[-1].shape not in (own.shape, (*batch, *own.shape)):
                wanted = " or ".join(
                    sorted({str(own.shape), str((*batch, *own.shape))})
                )
                raise ValueError(
                    f"world.{name} has shape {leaves[-1].shape}, expected {wanted}"
                )
        if (leaves[-1] < 0).any():
            raise ValueError("world.slot_size has a negative size")
        if all(leaf.shape == own.shape for leaf, own in zip(leaves, ours, strict=True)):
            return World(*leaves)
        shapes = [(*batch, *own.shape) for own in ours]
        return World(*map(np.broadcast_to, leaves, shapes))  # type: ignore[arg-type]

    def _search_rows(
        self,
        q_start: np.ndarray,
        q_goal: np.ndarray,
        seeds: Sequence[int],
        world: World,
        own: bool,
        rows: np.ndarray,
    ) -> PlanResult:
        """Searches some of the rows, padded to a size that compiles seldom."""
        size = (
            len(rows) if len(rows) == 1 else max(16, 1 << (len(rows) - 1).bit_length())
        )
        padded = np.resize(rows, size)
        active = np.arange(size) < len(rows)
        keys = _keys(np.array([seeds[row] for row in padded], np.uint32))
        start, goal = q_start[padded], q_goal[padded]
        if own:
            world = jax.tree.map(lambda leaf: np.asarray(leaf)[padded], world)
        draw = None if self._sampler is None else self._draw(keys, start, goal)
        result = self._search(own)(world, start, goal, goal, keys, draw, active)
        return jax.tree.map(np.asarray, result)

    def _search(self, own: bool) -> Callable[..., PlanResult]:
        """The compiled search; `own`: each problem has a world of its own."""
        if own not in self._searches:

            def config_free(
                worlds: World, problem: jax.Array, q: jax.Array
            ) -> jax.Array:
                world = (
                    jax.tree.map(lambda leaf: leaf[problem], worlds) if own else worlds
                )
                return collision.config_free(self.scene, world, q, self.config.margin)

            self._searches[own] = make_planner(
                config_free, self.config, self.q_min, self.q_max, _jit
            )
        return self._searches[own]

    def _draw(
        self, keys: jax.Array, start: np.ndarray, goal: np.ndarray
    ) -> Callable[[jax.Array], Segment]:
        return lambda chunk: self._banks(keys, chunk, start, goal)

    @cached_property
    def _banks(self) -> Callable[..., Segment]:
        count = max(BANK, self.config.workers)

        def bank(key, chunk, q_start, q_goal):
            # Apart from the numbers of the search, which fold in expansions from 0 on.
            key = jax.random.fold_in(jax.random.fold_in(key, 2**31), chunk)
            assert self._sampler is not None
            segment = Segment(*self._sampler(key, q_start, q_goal, count))
            shapes = jnp.shape(segment.direction), jnp.shape(segment.length)
            if shapes != ((count, len(q_start)), (count,)):
                raise ValueError(
                    f"the sampler's direction and length have shapes {shapes[0]} and "
                    f"{shapes[1]}, expected {(count, len(q_start))} and {(count,)}"
                )
            return segment

        return _jit(jax.vmap(bank))

    def _reason(self, plan: Plan, q_start: np.ndarray, q_goal: np.ndarray) -> str:
        """Why there is no path, in a line."""
        if plan.status == Status.BUDGET_EXHAUSTED:
            gap = np.linalg.norm(plan.path[-1] - q_goal)
            return (
                f"no path after {plan.expansions} expansions; "
                f"the nearest node is {gap:.3f} rad from the goal"
            )
        ends = (("start", q_start), ("goal", q_goal))
        if plan.status in (Status.START_IN_COLLISION, Status.GOAL_IN_COLLISION):
            name, q = ends[plan.status == Status.GOAL_IN_COLLISION]
            return f"{name} in collision: {self._contact(plan.world, q)}"
        if plan.status == Status.OUT_OF_LIMITS:
            over = [np.maximum(self.q_min - q, q - self.q_max) for _, q in ends]
            name, q = ends[int(over[1].max() > over[0].max())]
            j = int(np.argmax(np.maximum(*over)))
            return (
                f"{name} out of limits: joint {self.scene.joints[j]!r} at {q[j]:.4f}, "
                f"limits {self.q_min[j]:.4f} to {self.q_max[j]:.4f}"
            )
        if plan.status == Status.INVALID_INPUT:
            for name, q in ends:
                for j in np.flatnonzero(~np.isfinite(q)):
                    return f"{name} is not finite: joint {self.scene.joints[j]!r} is {q[j]}"
        return ""

    def _contact(self, world: World, q: np.ndarray) -> str:
        """The closest pair at q, by name, and how deep it is."""
        if not all(np.isfinite(np.asarray(leaf)).all() for leaf in world):
            return "the world has values that are not finite"
        poses = np.concatenate([world.object_pose, world.slot_pose])
        if not poses[:, 3:].any(-1).all():
            return "the world has a quaternion of zeros"
        pair, distance = collision.closest_pair(self.scene, world, q, 0.01)
        if pair is None:
            return "nothing within 10 mm by C MuJoCo"
        if distance >= 0:
            margin = 1000 * self.config.margin
            return (
                f"{pair[0]} and {pair[1]} are {1000 * distance:.2f} mm apart, "
                f"margin {margin:.2f} mm"
            )
        return f"{pair[0]} and {pair[1]}, {-1000 * distance:.2f} mm deep"


_jit: Any = partial(jax.jit, compiler_options=collision.XLA_OPTIONS)


@jax.jit
def _keys(seeds: jax.Array) -> jax.Array:
    return jax.vmap(jax.random.key)(seeds)


def _parts(count: int) -> list[np.ndarray]:
    """Rows of each thread: XLA on CPU keeps one core busy, and interleaving shares them fairly."""
    cores = os.cpu_count() or 1
    threads = min(cores, count // 16) if jax.default_backend() == "cpu" else 1
    return [np.arange(count)[i :: max(threads, 1)] for i in range(max(threads, 1))]


def _most(value: ArrayLike, d: int, name: str) -> np.ndarray:
    """`[d]` limits, checked."""
    try:
        limits = np.broadcast_to(np.asarray(value, float), d)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} {value!r}, expected a number or {d}") from None
    if not ((limits > 0) & np.isfinite(limits)).all():
        raise ValueError(f"{name} {value}, expected more than 0")
    return limits


def _rows(q: ArrayLike, axes: int, planner: Planner, name: str) -> np.ndarray:
    """q as float32, checked."""
    try:
        rows = np.asarray(q)
        rows = rows.astype(
            np.float64, casting="unsafe" if rows.dtype == object else "same_kind"
        )
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} is not an array of numbers: {error}") from None
    d = len(planner.scene.joints)
    if rows.ndim != axes or rows.shape[-1] != d:
        expected = f"({d},)" if axes == 1 else f"(problems, {d})"
        raise ValueError(f"{name} has shape {rows.shape}, expected {expected}")
    with np.errstate(over="ignore"):
        return rows.astype(np.float32)
