"""Whole problems about one scene, each answer judged by C MuJoCo.

What is not as it should be is kept as a fault, a line of text; so is any exception.
"""

import pickle
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from jaxplan.collision import (
    World,
    clearance_mujoco,
    closest_pair,
    make_world,
    required_clearances,
)
from jaxplan.collision.course import Course
from jaxplan.collision.oracle import Replica
from jaxplan.collision.rows import clearance_rows
from jaxplan.collision.touching import random_poses
from jaxplan.config import PlannerConfig
from jaxplan.evaluation.random_scenes import random_world
from jaxplan.ik import Pose
from jaxplan.motion import Plan, Planner
from jaxplan.scene import Scene
from jaxplan.scene.contacts import kind_of

BAND = 1e-4
"""Distances within this of contact [m] have no verdict: which side they are on is rounding."""
ALIKE = 1e-5
"""Distances of two programs differ by rounding only [m]."""
COMPARED = -0.01, 1.0
"""Those between [m]. How deep an overlap is, is searched for: found to 3e-4 of itself."""
REACH = 0.05
"""Distances are compared up to this [m]."""
STEP = 0.002
"""Motion of any two geoms between samples of a path [m]."""
LIMIT = 20.0
"""On the time of a problem [s]."""


@dataclass
class Judged:
    """What came of one scene."""

    faults: list[str] = field(default_factory=list)
    statuses: Counter[str] = field(default_factory=Counter)
    counts: Counter[str] = field(default_factory=Counter)


def interrogate(scene: Scene, seed: int, worlds: list[World]) -> Judged:
    """Asks everything there is to ask.

    Args:
        scene: The scene.
        seed: Of the problems and of the planner's settings.
        worlds: Where they are asked.
    """
    judged = Judged()
    try:
        rng = np.random.default_rng(seed)
        examiner = _Examiner(scene, rng, judged)
        for number, world in enumerate(worlds):
            for fault in examiner.faults(world, first=not number):
                judged.faults.append(f"world {number}: {fault}")
    except Exception:
        judged.faults.append(traceback.format_exc())
    return judged


class _Examiner:
    """A planner of random settings, and what it is asked."""

    def __init__(self, scene: Scene, rng: np.random.Generator, judged: Judged) -> None:
        self.scene, self.rng, self.judged = scene, rng, judged
        self.config = PlannerConfig(
            method="rrt" if rng.random() < 0.15 else "rrt_connect",
            max_expansions=3000,
            margin=float(rng.choice([0.0, 0.0, 0.001, 0.01])),
            workers=int(rng.choice([1, 16])),
        )
        self.planner = Planner(scene, self.config)
        # Each compiles programs of its own.
        self.asks = {what: rng.random() < 0.25 for what in ("alone", "poses")}
        self.required = np.asarray(required_clearances(scene, self.config.margin))

    def faults(self, world: World, first: bool) -> Iterator[str]:
        """What is wrong with the answers in one world; `first`: the longer list is asked."""
        planner, rng = self.planner, self.rng
        q = random_poses(self.scene, 200, int(rng.integers(2**31)))
        ours = clearance_rows(self.scene, world, q)
        yield from self._verdicts(world, q, ours)
        room = q[ours > self.required.max(initial=0.0) + 1e-3]
        ends = np.resize(room if len(room) else q, (8, q.shape[1]))
        batch = planner.plan_batch(ends[::2], ends[1::2], None, world, time_limit=LIMIT)
        for row, plan in enumerate(batch):
            pair = ends[2 * row], ends[2 * row + 1]
            yield from self._path(plan, *pair, f"problem {row}")
        if first and self.asks["alone"]:
            yield from self._alone(batch[0], ends, q, ours)
        if first and self.asks["poses"]:
            yield from self._poses(world, ends)

    def _alone(
        self, other: Plan, ends: np.ndarray, q: np.ndarray, ours: np.ndarray
    ) -> Iterator[str]:
        """The first problem of a batch on its own, of a copied planner; its distances."""
        planner = pickle.loads(pickle.dumps(self.planner))
        self.judged.counts["asked alone"] += 1
        plan = planner.plan(ends[0], ends[1], 0, other.world, time_limit=LIMIT)
        late = "TIME_OUT" in (plan.status.name, other.status.name)
        # To the last bit; but not where XLA is told to optimise nothing.
        same = plan.path.shape == other.path.shape
        if not late and not (same and np.allclose(plan.path, other.path, atol=ALIKE)):
            yield f"alone {plan.status.name}, in a batch {other.status.name}: not the same"
        own = planner.clearance(q, other.world)
        off = np.abs(np.clip(own, *COMPARED) - np.clip(ours, *COMPARED))
        if not off.max() < ALIKE:
            yield f"the planner's own distances are up to {off.max()} others"

    def _verdicts(self, world: World, q: np.ndarray, ours: np.ndarray) -> Iterator[str]:
        """Our distances beside C MuJoCo's."""
        theirs = clearance_mujoco(self.scene, world, q, REACH)
        self.judged.counts["configurations"] += len(q)
        wrong = ((ours > BAND) & (theirs < -BAND)) | ((ours < -BAND) & (theirs > BAND))
        near = (ours > 0) & (theirs > 0) & (np.minimum(ours, theirs) < REACH - BAND)
        wrong |= near & ~(np.abs(ours - theirs) < BAND)
        wrong |= ~np.isfinite(ours) & np.isfinite(theirs)
        for row in wrong.nonzero()[0]:
            pair, _ = closest_pair(self.scene, world, q[row])
            if ours[row] < theirs[row] and self._overlooked(pair):
                self.judged.counts["overlooked by C MuJoCo"] += 1
                continue
            yield (
                f"{1000 * ours[row]:.3f} mm, by C MuJoCo {1000 * theirs[row]:.3f} mm, "
                f"{pair} at {q[row].tolist()}"
            )

    def _overlooked(self, pair: tuple[str, str] | None) -> bool:
        """C MuJoCo does not see all capsules in boxes."""
        names = [self.scene.geom_name(g) for g in range(self.scene.mj_model.ngeom)]
        if pair is None or not set(pair) <= set(names):
            return True
        kinds = {kind_of(self.scene.mj_model, names.index(name)) for name in pair}
        return kinds == {"capsule", "box"}

    def _path(
        self, plan: Plan, start: np.ndarray, goal: np.ndarray | None, name: str
    ) -> Iterator[str]:
        """A plan, its certificates and the motion made of it."""
        judged = self.judged
        judged.statuses[plan.status.name] += 1
        if not plan.solved:
            if not plan.reason:
                yield f"{name}: {plan.status.name} without a reason"
            return
        judged.counts["paths"] += 1
        path = plan.path
        if not np.allclose(path[0], start, atol=1e-5):
            yield f"{name}: begins at {path[0].tolist()}, asked {start.tolist()}"
        if goal is not None:
            apart = path[-1] - goal
            turns = np.round(apart / (2 * np.pi)) * self.planner.circular
            apart = np.abs(apart - 2 * np.pi * turns).max()
            if apart > (
                self.config.goal_tolerance if self.config.method == "rrt" else 1e-4
            ):
                yield f"{name}: ends {apart:.5f} from the goal"
        yield from self._seen(plan.world, path, f"{name}: path")
        certificate = self.planner.certify(plan, resolution=STEP)
        if not certificate.valid:
            yield f"{name}: certify refuses the path: {certificate.reason}"
        if self.rng.random() < 0.3:
            proof = self.planner.certify(plan, continuous=True)
            judged.counts["proven"] += bool(proof.proven)
            judged.counts["asked to prove"] += 1
            if certificate.clearance < proof.clearance - BAND and proof.proven:
                yield f"{name}: proven {proof.clearance}, sampled {certificate.clearance}"
        timed = self.planner.time(plan)
        if not timed.free:
            judged.counts["motions not free"] += 1
            yield f"{name}: the motion is not free"
            return
        judged.counts["motions"] += 1
        yield from self._seen(plan.world, timed.q, f"{name}: motion")
        certificate = self.planner.certify(timed.q, plan.world, STEP)
        if not certificate.valid:
            yield f"{name}: certify refuses the motion: {certificate.reason}"

    def _seen(self, world: World, path: np.ndarray, name: str) -> Iterator[str]:
        """What C MuJoCo sees on a path, and limits that it leaves; the first of it."""
        low, high = self.planner.q_min, self.planner.q_max
        if (path < low - 1e-4).any() or (path > high + 1e-4).any():
            yield f"{name}: outside the joint limits"
        if not np.isfinite(path).all():
            yield f"{name}: not finite"
            return
        world = World(*map(np.asarray, world))  # pyright: ignore[reportArgumentType]
        course = Course(self.scene, world, path.astype(float))
        rows = course.rows(course.places(STEP))
        replica, reach = Replica(self.scene), float(self.required.max(initial=0.0))
        replica.load(world, rows)
        self.judged.counts["samples"] += len(rows)
        for row in range(len(rows)):
            replica.pose(row)
            distance, geoms = replica.contacts(reach)
            short = self.required[geoms[:, 0], geoms[:, 1]] - distance
            if short.size and short.max() > BAND:
                pair = geoms[short.argmax()]
                names = " and ".join(self.scene.geom_name(int(g)) for g in pair)
                yield (
                    f"{name}: {names} {1000 * distance[short.argmax()]:.3f} mm, required "
                    f"{1000 * self.required[tuple(pair)]:.3f}, at {rows[row].tolist()}"
                )
                return

    def _poses(self, world: World, ends: np.ndarray) -> Iterator[str]:
        """Inverse kinematics of where the hand is at a free configuration, and as a goal."""
        place = self._hand(world, ends[1:2])[0]
        pose = Pose(self.scene.hand, place)
        found = self.planner.ik(pose, world, count=8)
        self.judged.counts["poses"] += 1
        self.judged.counts["poses reached"] += bool(len(found))
        if len(found):
            away = np.linalg.norm(self._hand(world, found) - place, axis=-1).max()
            if away > np.sqrt(3) * 1e-3 + 1e-5:
                yield f"ik: {1000 * away:.3f} mm from the pose"
            low, high = self.planner.q_min, self.planner.q_max
            if (found < low - 1e-5).any() or (found > high + 1e-5).any():
                yield "ik: outside the joint limits"
            clear = self.planner.clearance(found, world)
            if not (clear > self.config.margin * 0).all():
                yield f"ik: in collision, {clear.min()}"
        if self.config.method == "rrt_connect":
            plan = self.planner.plan(ends[0], pose, 0, world, time_limit=LIMIT)
            yield from self._path(plan, ends[0], None, "pose")
            if plan.solved:
                end = self._hand(world, plan.path[-1:])[0]
                if np.abs(end - place).max() > 1e-3 + 1e-5:
                    yield f"pose: ends at {end}, asked {place}"

    def _hand(self, world: World, q: np.ndarray) -> np.ndarray:
        """`[n, 3]` where C MuJoCo has the hand."""
        replica, body = Replica(self.scene), self.scene.body_id(self.scene.hand)
        replica.load(world, np.asarray(q, float))
        places = []
        for row in range(len(q)):
            replica.pose(row)
            places.append(replica.data.xpos[body].copy())
        return np.array(places)


def worlds_of(scene: Scene, seed: int, count: int) -> list[World]:
    """The model's own world, and random ones."""
    rng = np.random.default_rng(seed)
    return [make_world(scene), *(random_world(scene, rng) for _ in range(count))]
