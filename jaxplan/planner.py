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
from jaxplan.blocks import in_blocks
from jaxplan.collision import Certificate, World, make_world
from jaxplan.config import PlannerConfig, TrajectoryConfig
from jaxplan.plan import Plan, Timed
from jaxplan.planning import PlanResult, Segment, Status, make_planner
from jaxplan.planning.settings import check_settings
from jaxplan.process import refuse_fork
from jaxplan.ranges import Step, check
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
        check("scene", scene, Scene)
        check("config", config, PlannerConfig)
        check("trajectory", trajectory, TrajectoryConfig)
        check("sampler", sampler, Callable | None)
        self.scene, self.config = scene, config
        self._trajectory, self._sampler = trajectory, sampler
        self._d = d = len(scene.joints)
        self._velocity = questions.most(velocity, d, "velocity")
        self._acceleration = questions.most(acceleration, d, "acceleration")
        far = np.array([UNLIMITED[scene.joint_kind(name)] for name in scene.joints])
        own = scene.q_min, scene.q_max
        limits = questions.joint_limits((q_min, q_max), own, scene.joints)
        self.q_min, self.q_max = (np.clip(limit, -far, far) for limit in limits)
        check_settings(config, self.q_min, self.q_max)
        self._searches: dict[bool, Callable[..., PlanResult]] = {}

    def __getstate__(self) -> dict[str, Any]:
        """A copy is without compiled programs and what else is made at need."""
        kept = {
            name: value
            for name, value in vars(self).items()
            if not isinstance(getattr(type(self), name, None), cached_property)
        }
        return kept | {"_searches": {}}

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
        seeds = questions.seeds_of([seed])
        return self._plan(start, goal, seeds, world)[0]

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
        seeds = questions.seeds_of(range(len(q_starts)) if seeds is None else seeds)
        if not len(q_starts) == len(q_goals) == len(seeds):
            sizes = f"{len(q_starts)}, {len(q_goals)} and {len(seeds)}"
            raise ValueError(f"q_starts, q_goals and seeds have {sizes} rows")
        if worlds is None or isinstance(worlds, World):
            return self._plan(q_starts, q_goals, seeds, worlds)
        stacked = questions.worlds_of(worlds, self.empty_world, len(seeds))
        return self._plan(q_starts, q_goals, seeds, stacked)

    def time(self, plan: Plan, speed: float = 1.0) -> Timed:
        """Shortens, smooths and times a path (section 4.3), and checks all of it again.

        Args:
            plan: A solved one.
            speed: Factor on the velocity limits, its square on the accelerations.

        Raises:
            ValueError: The plan has no path to its goal, or one that is empty or not
                finite; a speed that makes no sense.
        """
        refuse_fork()
        check("plan", plan, Plan)
        if not plan.solved:
            raise ValueError(f"no motion to time: {plan.reason}")
        path = questions.waypoints(plan.path, self._d)
        world = questions.world_of(plan.world, self.empty_world, ())
        speed = questions.number(speed, Step, "speed")
        timed = make_trajectory(
            path[None],
            np.array([len(path)]),
            _keys(np.array(questions.seeds_of([plan.seed]), np.uint32)),
            lambda problem, q: self._free(world, q),
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
        resolution: float = 0.005,
        tolerance: float = 0.001,
        continuous: bool = False,
    ) -> Certificate:
        """What C MuJoCo and our own distance say about a path; see `collision.certify`.

        Args:
            plan: A plan, or waypoints `[n, d]` [rad or m].
            world: The plan's own where None.
            resolution: No two geoms move by more than this against each other between two
                checked configurations [m].
            tolerance: Penetration that still passes [m].
            continuous: Prove it between checked configurations too.

        Raises:
            ValueError: An argument makes no sense.
        """
        path = plan.path if isinstance(plan, Plan) else plan
        own = plan.world if isinstance(plan, Plan) else self.empty_world
        world = own if world is None else world
        return collision.certify(
            self.scene, world, path, resolution, tolerance, continuous
        )

    def clearance(self, qs: ArrayLike, world: World | None = None) -> np.ndarray:
        """Least signed distance over all pairs that count `[...]` [m], negative = penetration.

        Args:
            qs: `[..., d]` [rad].
            world: The model's own where None; its leading axes broadcast against those
                of qs.

        Raises:
            ValueError: An argument of the wrong shape or type.
        """
        refuse_fork()
        q = questions.rows(qs, None, self._d, "qs")
        empty = self.empty_world
        world = empty if world is None else world
        batch = questions.batch_of(world, empty, q.shape[:-1])
        world = questions.world_of(world, empty, batch)
        q = np.broadcast_to(q, (*batch, self._d)).reshape(-1, self._d)
        if world.passive.ndim == empty.passive.ndim:  # one for all
            found = in_blocks(partial(self._clearance, world), q)
        else:
            leaves = zip(world, empty, strict=True)
            each = World(*(leaf.reshape(len(q), *own.shape) for leaf, own in leaves))
            found = in_blocks(self._clearance, each, q)
        return found.reshape(batch)

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
        refuse_fork()
        count = len(seeds)
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
