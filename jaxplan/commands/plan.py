"""`jaxplan plan`: from one pose of a model to another, certified, timed, on film."""

import json
import time
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxplan.cells import furnished, read_json, slots_of
from jaxplan.collision import Certificate, World
from jaxplan.collision.positions import qpos_rows
from jaxplan.collision.replica import fill, mujoco_model
from jaxplan.commands.model import (
    NamedPose,
    read_pose,
    read_scene,
    world_at,
)
from jaxplan.config import PlannerConfig
from jaxplan.motion import Plan, Planner, Timed
from jaxplan.motion.reasons import joint_distance
from jaxplan.pretrained import load_sampler
from jaxplan.provenance import versions
from jaxplan.scene import Scene
from jaxplan.simulation.camera import require_gl
from jaxplan.simulation.video import FPS, film_motion

RECORD, VIDEO = "plan.json", "plan.mp4"
"""What is written; a file of these names that stands there is replaced or removed."""


def plan(
    path: Path,
    start: str,
    goal: str,
    seed: int = 0,
    out: Path | None = None,
    video: bool = False,
    joints: str | None = None,
    hand: str | None = None,
    velocity: float = 1.0,
    acceleration: float = 2.0,
    time_limit: float | None = None,
    obstacles: Path | None = None,
    sampler: Path | None = None,
    config: PlannerConfig = PlannerConfig(),
) -> bool:
    """Plans, asks C MuJoCo about path and motion, and says what came of it.

    Args:
        path: Of the MJCF.
        start: Key frame or numbers; fingers and objects stand as in its key frame.
        goal: Key frame or numbers.
        seed: Of the search.
        out: Directory for `plan.json` and `plan.mp4`; None writes nothing.
        video: Whether to render the motion.
        joints: See `read_scene`.
        hand: See `read_scene`.
        velocity: Of each joint at most [rad/s or m/s].
        acceleration: Of each joint at most [rad/s^2 or m/s^2].
        time_limit: Of the search [s]; None = its budget of expansions alone.
        obstacles: JSON with obstacles and objects, see `cells.problem`.
        sampler: Directory of weights, see `pretrained.load_sampler`.
        config: Of the planner.

    Returns:
        Whether there is a certified motion.

    Raises:
        ValueError: Bad input.
        NoGLError: A video is wanted, and nothing can be rendered here.
    """
    if video and out is None:
        raise ValueError("--video needs --out")
    learned = None if sampler is None else load_sampler(sampler)
    given = {} if obstacles is None else read_json(obstacles)
    slots = slots_of([given]) if learned is None else learned.scene["slots"]
    scene = read_scene(path, joints, hand, slots)
    first, last = read_pose(scene, start, "start"), read_pose(scene, goal, "goal")
    planner = Planner(
        scene, config, sampler=learned, velocity=velocity, acceleration=acceleration
    )
    if video:
        require_gl()
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        for name in (RECORD, VIDEO):  # of a run before
            (out / name).unlink(missing_ok=True)
    world = furnished(scene, world_at(scene, first), given)
    began = time.perf_counter()
    planner.plan(
        first.q, first.q, seed, world
    )  # compiles, so that times are of the search
    print(
        f"{path}: {len(scene.joints)} joints, {len(scene.pairs)} pairs that can touch"
    )
    print(f"ready in {time.perf_counter() - began:.1f} s")
    answer = planner.plan(first.q, last.q, seed, world, time_limit)
    _show(scene, answer)
    timed, certificates = None, {}
    if answer.solved:
        timed = planner.time(answer)
        paths = {"path": answer.path, "motion": timed.q}
        certificates = {k: planner.certify(q, world) for k, q in paths.items()}
        print(f"motion: {timed.t[-1]:.2f} s, {len(timed.t)} samples")
        for name, certificate in certificates.items():
            print(f"certificate of the {name}: {_verdict(certificate)}")
    good = answer.solved and all(c.valid for c in certificates.values())
    if out is not None:
        record = _record(path, scene, (first, last), answer, timed, certificates)
        written = [out / RECORD]
        written[0].write_text(json.dumps(record, indent=1) + "\n")
        if video and timed is not None:
            written.append(out / VIDEO)
            _film(written[1], scene, world, timed)
        print(f"written: {', '.join(map(str, written))}")
    return good


def _film(path: Path, scene: Scene, world: World, timed: Timed) -> None:
    """The motion, among what is there."""
    frames = np.arange(0, timed.t[-1] + 1 / FPS, 1 / FPS)
    q = np.stack([np.interp(frames, timed.t, joint) for joint in timed.q.T], -1)
    model, rows = mujoco_model(scene), (len(q),)
    fill(scene, model, world)
    worlds = jax.tree.map(lambda leaf: np.broadcast_to(leaf, rows + leaf.shape), world)
    film_motion(path, model, qpos_rows(scene, worlds, q))


def _show(scene: Scene, answer: Plan) -> None:
    status = answer.status.name.lower()
    print(f"{status}: {answer.reason}" if answer.reason else status)
    print(
        f"search: {answer.expansions} expansions, {answer.checks} checks, "
        f"{answer.time:.3f} s"
    )
    if answer.solved:
        length = joint_distance(scene, answer.length)
        print(f"path: {len(answer.path)} waypoints, {length}")


def _verdict(certificate: Certificate) -> str:
    """A certificate in words."""
    if not certificate.valid:
        return f"refused: {certificate.reason}"
    if certificate.pair is None:
        return "free"
    gap = f"{1000 * certificate.clearance:.2f} mm at {certificate.where:.2f}"
    return f"free, nearest {' and '.join(certificate.pair)}, {gap}"


def _record(
    path: Path,
    scene: Scene,
    ends: tuple[NamedPose, NamedPose],
    answer: Plan,
    timed: Timed | None,
    certificates: dict[str, Certificate],
) -> dict[str, Any]:
    """What `plan.json` holds; lengths in rad or m, times in s."""
    return {
        "model": str(path),
        "joints": scene.joints,
        "start": ends[0].q.tolist(),
        "goal": ends[1].q.tolist(),
        "seed": answer.seed,
        "status": answer.status.name.lower(),
        "reason": answer.reason,
        "expansions": answer.expansions,
        "checks": answer.checks,
        "seconds": answer.time,
        "length": answer.length,
        "path": answer.path.tolist(),
        "certified": {name: c.valid for name, c in certificates.items()},
        "trajectory": timed
        and {name: getattr(timed, name).tolist() for name in ("t", "q", "qd", "qdd")},
        "versions": versions(),
    }
