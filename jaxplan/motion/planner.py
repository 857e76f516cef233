"""The planner as a library: problems about one robot in, certified and timed motions out.

    scene = jaxplan.Scene.from_mjcf("robot.xml")
    planner = jaxplan.Planner(scene)
    plan = planner.plan(q_start, q_goal)
    planner.certify(plan), planner.time(plan)

Statuses say what came of a problem; exceptions say that it was none. The episode loop has a
planner of its own (`motion.executable`), for the same searches: its problems come in batches of
one size, their goals are predictions that may lie a hair inside an obstacle, and what it gives
is at once a motion to be executed.
"""

import math
from collections.abc import Callable, Sequence
from functools import cached_property, partial

import numpy as np
from numpy.typing import ArrayLike

from jaxplan import collision
from jaxplan.collision import Certificate, World, make_world
from jaxplan.config import PlannerConfig, TrajectoryConfig
from jaxplan.ik import Limits, Pose, inverse_kinematics
from jaxplan.motion import checks
from jaxplan.motion.batch import keys_of
from jaxplan.motion.clearances import clearances
from jaxplan.motion.plan import Plan, Timed
from jaxplan.motion.sampling import SIZE, FunctionSampler, Sampler, SegmentFunction
from jaxplan.motion.search import Search
from jaxplan.motion.shortening import shortened
from jaxplan.motion.solver import Goal, Solver
from jaxplan.planning.settings import check_settings
from jaxplan.process import refuse_fork
from jaxplan.ranges import Positive, Step, check
from jaxplan.scene import Scene
from jaxplan.trajectory import Rung, make_trajectory


class Planner:
    """Plans motions of one arm.

    Everything compiles once, at the first problem of its kind; a `World` that changes from
    problem to problem compiles nothing anew.

    Args:
        scene: What can touch what.
        config: Settings of the search.
        trajectory: Settings of smoothing and timing.
        sampler: Proposes segments, a function or trained weights (`jaxplan.load_sampler`,
            `samplers.Bank.seeing`); without it all proposals are uniform.
        velocity: Of each joint at most, or `[d]` [rad/s or m/s].
        acceleration: Of each joint at most, or `[d]` [rad/s^2 or m/s^2].
        q_min: `[d]` lower joint limits; the model's where None. A hinge without limits
            comes round: q and q + 2 pi are the same.
        q_max: `[d]` upper joint limits; the model's where None.

    Raises:
        ValueError: A setting that makes no sense; a sampler of another scene.
    """

    def __init__(
        self,
        scene: Scene,
        config: PlannerConfig = PlannerConfig(),
        trajectory: TrajectoryConfig = TrajectoryConfig(),
        sampler: Sampler | SegmentFunction | None = None,
        velocity: ArrayLike = 1.0,
        acceleration: ArrayLike = 2.0,
        q_min: ArrayLike | None = None,
        q_max: ArrayLike | None = None,
    ) -> None:
        check("scene", scene, Scene)
        check("config", config, PlannerConfig)
        check("trajectory", trajectory, TrajectoryConfig)
        if not isinstance(sampler, Sampler | None):
            check("sampler", sampler, Callable)
            sampler = FunctionSampler(sampler, max(SIZE, config.workers))
        self.scene, self.config = scene, config
        self._trajectory = trajectory
        self._d = d = len(scene.joints)
        self._velocity = checks.most(velocity, d, "velocity")
        self._acceleration = checks.most(acceleration, d, "acceleration")
        own = scene.q_min, scene.q_max
        limits = checks.joint_limits((q_min, q_max), own, scene.joints)
        self.q_min, self.q_max = limits
        self.circular = scene.circular & np.isinf(self.q_min) & np.isinf(self.q_max)
        check_settings(config, d)
        self._search = Search(scene, config, self.limits)
        self._solver = Solver(scene, config, self.limits, self._search, sampler)

    @property
    def limits(self) -> Limits:
        """Of the joints."""
        return Limits(self.q_min, self.q_max, self.circular)

    @cached_property
    def empty_world(self) -> World:
        """The world as the model has it, without obstacles in its slots."""
        return make_world(self.scene)

    def plan(
        self,
        q_start: ArrayLike,
        q_goal: Goal,
        seed: int = 0,
        world: World | None = None,
        time_limit: float | None = None,
    ) -> Plan:
        """Finds a collision-free path.

        The same problem with the same seed has the same answer, alone or in a batch, unless
        a time limit ends it.

        Args:
            q_start: `[d]` [rad or m].
            q_goal: `[d]` [rad or m]; several, `[G, d]`, of which any will do (method
                `rrt_connect`); or a `Pose` of a body.
            seed: At least 0.
            world: Where things are, see `collision.make_world`; the model's where None.
            time_limit: What is open then is TIME_OUT [s]; what has to be compiled counts too.

        Raises:
            ValueError: An argument of the wrong shape or type.
        """
        start = checks.rows(q_start, 1, self._d, "q_start")[None]
        seeds = checks.seeds_of([seed])
        return self._solve(start, [q_goal], seeds, world, time_limit)[0]

    def plan_batch(
        self,
        q_starts: ArrayLike,
        q_goals: ArrayLike | Sequence[Goal],
        seeds: Sequence[int] | None = None,
        worlds: World | Sequence[World] | None = None,
        time_limit: float | None = None,
    ) -> list[Plan]:
        """Answers P problems in one call.

        Args:
            q_starts: `[P, d]` [rad or m].
            q_goals: `[P, d]` or `[P, G, d]` [rad or m], or P goals as `plan` takes them.
            seeds: P, each at least 0; 0 to P - 1 where None.
            worlds: One for all, one for each, or one whose leaves have a leading axis P.
            time_limit: Of all of them together [s].

        Raises:
            ValueError: An argument of the wrong shape or type.
        """
        q_starts = checks.rows(q_starts, 2, self._d, "q_starts")
        goals = checks.goals(q_goals, self._d)
        seeds = checks.seeds_of(range(len(q_starts)) if seeds is None else seeds)
        if not len(q_starts) == len(goals) == len(seeds):
            sizes = f"{len(q_starts)}, {len(goals)} and {len(seeds)}"
            raise ValueError(f"q_starts, q_goals and seeds have {sizes} rows")
        if worlds is None or isinstance(worlds, World):
            return self._solve(q_starts, goals, seeds, worlds, time_limit)
        each = checks.worlds_of(worlds, self.empty_world, len(seeds))
        return self._solve(q_starts, goals, seeds, each, time_limit)

    def ik(
        self,
        pose: Pose,
        world: World | None = None,
        reference: ArrayLike | None = None,
        seed: int = 0,
        count: int = 32,
    ) -> np.ndarray:
        """Free configurations that bring a body to a pose, from the nearest to the reference on.

        Args:
            pose: What is wanted.
            world: The model's own where None.
            reference: `[d]` [rad or m]; the model's reference pose where None.
            seed: Of the starts of the descent, at least 0.
            count: Of configurations at most.

        Returns:
            `[n, d]` [rad or m]; n = 0 where none is found that is within limits and free.

        Raises:
            ValueError: An argument that makes no sense.
        """
        refuse_fork()
        check("pose", pose, Pose)
        given = self.empty_world if world is None else world
        world = checks.world_of(given, self.empty_world, ())
        (seed,) = checks.seeds_of([seed])
        free = partial(self._search.free, world)
        return inverse_kinematics(
            self.scene, world, pose, self.limits, reference, seed, count, free
        ).q

    def shorten(self, plans: Sequence[Plan]) -> list[Plan]:
        """Replaces stretches of paths by straight lines that are free, as `time` does.

        Where joints come round, a path may end full turns from its goal. Plans that are not
        solved stay as they are.
        """
        refuse_fork()
        for plan in plans:
            check("plans", plan, Plan)
        return shortened(plans, self._search, self._trajectory, self.circular)

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
        path = checks.waypoints(plan.path, self._d)
        world = checks.world_of(plan.world, self.empty_world, ())
        speed = checks.number(speed, Step, "speed")
        timed = make_trajectory(
            path[None],
            np.array([len(path)]),
            keys_of(checks.seeds_of([plan.seed])),
            lambda problem, q: self._search.free(world, q),
            speed * self._velocity,
            speed**2 * self._acceleration,
            self._trajectory,
            self.circular,
            lambda problem, q, motion: self._search.free(world, q, motion),
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
        q = checks.rows(qs, None, self._d, "qs")
        given = self.empty_world if world is None else world
        return clearances(self._search, given, self.empty_world, q)

    def _solve(
        self,
        q_start: np.ndarray,
        goals: Sequence[Goal],
        seeds: Sequence[int],
        world: World | None,
        time_limit: float | None,
    ) -> list[Plan]:
        """Plans for rows `[P, d]`; leaves of the world have a leading axis or none."""
        refuse_fork()
        limit = math.inf
        if time_limit is not None:
            limit = checks.number(time_limit, Positive, "time_limit")
        count, empty = len(seeds), self.empty_world
        world = checks.world_of(empty if world is None else world, empty, (count,))
        own = bool(world.passive.ndim > empty.passive.ndim)
        return self._solver(q_start, goals, seeds, world, own, limit) if count else []
