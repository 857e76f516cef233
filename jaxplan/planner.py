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
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from jaxplan import collision, questions
from jaxplan.collision import Certificate, World, make_world
from jaxplan.config import PlannerConfig, TrajectoryConfig
from jaxplan.plan import Plan, Timed
from jaxplan.planning import PlanResult, Segment, Status, make_planner
from jaxplan.reason import no_path
from jaxplan.scene import Scene
from jaxplan.trajectory import Rung, make_trajectory

Sampler = Callable[[jax.Array, jax.Array, jax.Array, int], Segment]
"""`(key, q_start [d], q_goal [d], count) -> Segment [count]`: tree-extension segments for a
problem, with the configurations where they begin or without; traced by JAX."""

BANK = 64
"""Segments that a sampler is asked for at a time."""
UNLIMITED = {"hinge": 2 * np.pi, "slide": 10.0}
"""How far from 0 a joint without limits is searched [rad or m]."""


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
        self._d = d = len(scene.joints)
        self._velocity = questions.most(velocity, d, "velocity")
        self._acceleration = questions.most(acceleration, d, "acceleration")
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
        start = questions.rows(q_start, 1, self._d, "q_start")[None]
        goal = questions.rows(q_goal, 1, self._d, "q_goal")[None]
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
            questions.rows(q, 2, self._d, n)
            for q, n in ((q_starts, "q_starts"), (q_goals, "q_goals"))
        )
        seeds = list(range(len(q_starts))) if seeds is None else list(seeds)
        if not len(q_starts) == len(q_goals) == len(seeds):
            sizes = f"{len(q_starts)}, {len(q_goals)} and {len(seeds)}"
            raise ValueError(f"q_starts, q_goals and seeds have {sizes} rows")
        if worlds is None or isinstance(worlds, World):
            return self._plan(q_starts, q_goals, seeds, worlds)
        rows = [questions.world_of(world, self.empty_world, ()) for world in worlds]
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
            swept_free=lambda problem, q, motion: self._swept(plan.world, q, motion),
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
        if q.ndim < 1 or q.shape[-1] != self._d:
            raise ValueError(f"qs has shape {q.shape}, expected (..., {self._d})")
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

    @cached_property
    def _swept(self) -> Callable:
        margin = self.config.margin
        return _jit(
            lambda world, q, motion: collision.config_free(
                self.scene, world, q, margin, motion=motion
            )
        )

    def _plan(
        self,
        q_start: np.ndarray,
        q_goal: np.ndarray,
        seeds: Sequence[int],
        world: World | None,
    ) -> list[Plan]:
        """Plans for rows `[P, d]`; leaves of the world have a leading axis or none."""
        count = len(questions.seeds_of(seeds))
        empty = self.empty_world
        world = questions.world_of(empty if world is None else world, empty, (count,))
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
                reason = no_path(
                    self.scene,
                    plan,
                    q_start[row],
                    q_goal[row],
                    (self.q_min, self.q_max),
                    self.config.margin,
                )
                plans[row] = dataclasses.replace(plan, reason=reason)
        return [plans[row] for row in range(count)]

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
            many = count, len(q_start)
            expected = {"direction": many, "length": (count,), "base": many}
            for name, leaf in segment._asdict().items():
                if leaf is not None and jnp.shape(leaf) != expected[name]:
                    raise ValueError(
                        f"the sampler's {name} has shape {jnp.shape(leaf)}, "
                        f"expected {expected[name]}"
                    )
            return segment

        return _jit(jax.vmap(bank))


_jit: Any = partial(jax.jit, compiler_options=collision.XLA_OPTIONS)


@jax.jit
def _keys(seeds: jax.Array) -> jax.Array:
    return jax.vmap(jax.random.key)(seeds)


def _parts(count: int) -> list[np.ndarray]:
    """Rows of each thread: XLA on CPU keeps one core and a half busy with a search.

    Two threads a core, because hard problems make some end much later than others;
    interleaving shares these fairly.
    """
    cores = os.cpu_count() or 1
    wanted = min(2 * cores, count // 16) if jax.default_backend() == "cpu" else 1
    threads = max(wanted, 1)
    return [np.arange(count)[i::threads] for i in range(threads)]
