"""R1, R2, R5: paths and motions, verdicts, completeness."""

from collections import Counter
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import jaxplan
from jaxplan.collision import Obstacle, clearance_mujoco
from jaxplan.evaluation.motion_bench import (
    data_directory,
    read_problems,
    read_robot,
    robot_mjcf,
)
from jaxplan.evaluation.random_scenes import random_scene, random_world
from parts.promises.promise import Promise, Trial

SLOTS = {"box": 4, "cylinder": 2, "sphere": 2}
SIZES = {"box": 3, "ellipsoid": 3, "cylinder": 2, "capsule": 2, "sphere": 1}
"""Numbers of each kind."""
ARMS = ("panda", "fetch", 2, 13)
"""Published ones as spheres, and scenes drawn by seed: two arms and meshes among them."""
NEAR = 1e-4
"""A verdict on distances that are smaller [m] is rounding."""


def _planner(arm: str | int) -> jaxplan.Planner:
    if isinstance(arm, int):
        return jaxplan.Planner(random_scene(arm).read())
    robot = read_robot(data_directory(), arm)
    return jaxplan.Planner(jaxplan.Scene.from_mjcf(robot_mjcf(robot), slots=SLOTS))


def _world(planner: jaxplan.Planner, rng: np.random.Generator) -> jaxplan.World:
    """Some obstacles where the arm can meet them."""
    scene = planner.scene
    if scene.objects:
        return random_world(scene, rng)
    obstacles = [
        Obstacle(
            slot.kind,
            rng.uniform(0.03, 0.2, SIZES[slot.kind]).tolist(),
            [*rng.uniform([-0.3, -0.8, 0.1], [0.9, 0.8, 1.1]), *rng.normal(size=4)],
        )
        for slot in scene.slots
        if rng.random() < 0.8
    ]
    return jaxplan.make_world(scene, obstacles=obstacles)


def _draw(planner: jaxplan.Planner, rng: np.random.Generator, count: int) -> np.ndarray:
    """`[count, d]` within the limits, or a turn."""
    low = np.where(np.isfinite(planner.q_min), planner.q_min, -np.pi)
    high = np.where(np.isfinite(planner.q_max), planner.q_max, np.pi)
    return rng.uniform(low, high, (count, len(low)))


def _paths(place: Path) -> Trial:
    """A piece is of one arm: problems in a world each, answered as a batch."""
    planners: dict[int, jaxplan.Planner] = {}

    def trial(numbers: range) -> list[str]:
        arm = numbers.start // len(numbers) % len(ARMS)
        planner = planners.setdefault(arm, _planner(ARMS[arm]))
        faults, solved, draw = [], 0, 0
        while solved < len(numbers):
            rng = np.random.default_rng([numbers.start, draw])
            draw += 1
            worlds = [_world(planner, rng) for _ in range(32)]
            ends = [_free(planner, rng, world) for world in worlds]
            plans = planner.plan_batch(
                [q[0] for q in ends], [q[1] for q in ends], worlds=worlds
            )
            for plan in plans:
                if plan.solved and solved < len(numbers):
                    solved += 1
                    faults += _refused(planner, plan, f"{ARMS[arm]} {numbers.start}")
        return faults

    return trial


def _free(planner: jaxplan.Planner, rng: Any, world: jaxplan.World) -> np.ndarray:
    """Two free configurations, or whatever the last two of many are."""
    q = _draw(planner, rng, 64)
    order = np.argsort(planner.clearance(q, world) <= 0, kind="stable")
    return q[order[:2]]


def _refused(planner: jaxplan.Planner, plan: jaxplan.Plan, name: str) -> list[str]:
    """What is wrong with a path and the motion that is made of it."""
    faults = []
    if not (found := planner.certify(plan, resolution=0.002)).valid:
        faults.append(f"{name}: path: {found.reason}")
    timed = planner.time(plan)
    if not timed.free:
        faults.append(f"{name}: motion is not free")
    if not (found := planner.certify(timed.q, plan.world, 0.002)).valid:
        faults.append(f"{name}: motion: {found.reason}")
    beyond = {
        "velocity": np.abs(timed.qd).max() - 1.0,
        "acceleration": np.abs(timed.qdd).max() - 2.0,
    }
    faults += [
        f"{name}: {what} {over:.3g} above its limit"
        for what, over in beyond.items()
        if over > 1e-3
    ]
    return faults


def _verdicts(place: Path) -> Trial:
    """Distances against C MuJoCo's; the last tenth of the numbers are close to contact."""
    planners: dict[int, jaxplan.Planner] = {}

    def trial(numbers: range) -> list[str]:
        arm = numbers.start // len(numbers) % len(ARMS)
        planner = planners.setdefault(arm, _planner(ARMS[arm]))
        rng = np.random.default_rng(numbers.start)
        world = _world(planner, rng)
        q = _draw(planner, rng, len(numbers))
        if numbers.start >= 100_000:
            q = _to_contact(planner, world, q, _draw(planner, rng, len(numbers)))
        ours = planner.clearance(q, world)
        theirs = clearance_mujoco(planner.scene, world, q)
        wrong = (ours > 0) != (theirs > 0)
        wrong &= np.minimum(np.abs(ours), np.abs(theirs)) > NEAR
        return [
            f"{ARMS[arm]} {numbers.start + i}: {ours[i]:.6f} m, C MuJoCo {theirs[i]:.6f} m"
            for i in np.flatnonzero(wrong)
        ]

    return trial


def _to_contact(
    planner: jaxplan.Planner, world: jaxplan.World, a: np.ndarray, b: np.ndarray
) -> np.ndarray:
    """Between configurations on either side of contact, where it begins."""
    in_contact = planner.clearance(a, world) <= 0
    for _ in range(12):
        middle = (a + b) / 2
        same = (planner.clearance(middle, world) <= 0) == in_contact
        a, b = (
            np.where(same[:, None], middle, a),
            np.where(same[:, None], b, middle),
        )
    return a


DISC = """<mujoco><worldbody><body name="disc">
<joint name="x" type="slide" axis="1 0 0" range="-1 1"/>
<joint name="y" type="slide" axis="0 1 0" range="-1 1"/>
<geom name="disc" type="sphere" size="0.03"/>
</body></worldbody></mujoco>"""


def _constant(q_start: jax.Array, q_goal: jax.Array) -> tuple[jax.Array, float]:
    return jnp.ones_like(q_start), 0.1


def _nan(q_start: jax.Array, q_goal: jax.Array) -> tuple[jax.Array, float]:
    return jnp.full_like(q_start, jnp.nan), jnp.nan


def _away(q_start: jax.Array, q_goal: jax.Array) -> tuple[jax.Array, float]:
    return q_start - q_goal, 0.2


def _many(one: Any) -> Any:
    """As a planner asks for segments."""

    def sampler(key: jax.Array, q_start: jax.Array, q_goal: jax.Array, count: int):
        direction, length = one(q_start, q_goal)
        every = jnp.broadcast_to(direction, (count, len(q_start)))
        return jaxplan.Segment(every, jnp.full(count, length))

    return sampler


HOSTILE = tuple(_many(one) for one in (_constant, _nan, _away))


def _completeness(place: Path) -> Trial:
    """A disc before a wall with a gap, the Panda among MotionBenchMaker's obstacles, by turns."""
    problems = [p for each in read_problems(data_directory()).values() for p in each]
    most = Counter[str]()
    for problem in problems:
        most |= Counter(obstacle.kind for obstacle in problem.obstacles)
    panda = robot_mjcf(read_robot(data_directory()))
    config = jaxplan.PlannerConfig(max_expansions=200_000, p_uniform=0.2)
    planners = [
        [jaxplan.Planner(scene, config, sampler=sampler) for sampler in HOSTILE]
        for scene in (
            jaxplan.Scene.from_mjcf(DISC, slots={"box": 2}),
            jaxplan.Scene.from_mjcf(panda, slots=most),
        )
    ]

    def ends(number: int) -> tuple[Any, Any, list[Obstacle]]:
        if number % 2:
            problem = problems[number // 2 % len(problems)]
            return problem.q_start, problem.q_goal, list(problem.obstacles)
        rng = np.random.default_rng(number)
        gap, middle = rng.uniform(0.08, 0.15), rng.uniform(-0.6, 0.6)
        wall = [(-1.0, middle - gap / 2), (middle + gap / 2, 1.0)]
        boxes = [
            Obstacle("box", [0.05, (high - low) / 2, 0.1], [0, (low + high) / 2, 0])
            for low, high in wall
        ]
        y_start, y_goal = rng.uniform(-0.9, 0.9, 2)
        return [-0.8, y_start], [0.8, y_goal], boxes

    def trial(numbers: range) -> list[str]:
        faults = []
        for number in numbers:
            planner = planners[number % 2][number // 2 % len(HOSTILE)]
            q_start, q_goal, obstacles = ends(number)
            world = jaxplan.make_world(planner.scene, obstacles=obstacles)
            plan = planner.plan(q_start, q_goal, number, world)
            if not plan.solved:
                faults.append(f"{number}: {plan.status.name}: {plan.reason}")
        return faults

    return trial


PROMISES = (
    Promise(
        "R1",
        "a path or motion that C MuJoCo refuses, or beyond its limits: Panda, Fetch, two arms, "
        "meshes",
        10_000,
        250,
        _paths,
    ),
    Promise(
        "R2",
        "a verdict that is not C MuJoCo's, farther than 0.1 mm from contact",
        110_000,
        2500,
        _verdicts,
    ),
    Promise(
        "R5",
        "a problem left unsolved with a sampler that says nonsense (constant, NaN, away)",
        500,
        100,
        _completeness,
    ),
)
