"""Where a scene's sampler proposes to go, before training and after, beside uniform proposals.

    python eval/sampler_picture.py docs/arm.xml docs/cell.json weights/cell

For the first drawn problem whose straight motion is blocked. The arm stands at the start, a
cross is the goal, and a dot is where a proposal would bring the hand.
"""

from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from pictures.sheet import Key, sheet
from PIL import Image
from tyro.conf import Positional

from jaxplan import Planner, Scene, load_sampler
from jaxplan.cells import Cell, Problem, read_json
from jaxplan.cli import run_script
from jaxplan.collision.kinematics import frame_pose
from jaxplan.collision.positions import qpos_rows
from jaxplan.collision.replica import fill, mujoco_model
from jaxplan.pictures.painter import PROPOSAL, SUBGOAL, Mark, marked
from jaxplan.ranges import Checked, Count, Whole
from jaxplan.samplers import SceneSampler, init
from jaxplan.simulation.camera import Camera
from jaxplan.simulation.video import fitting_view

HEIGHT, WIDTH = 480, 640
SEED = 2**20
"""Of the drawn problems: recordings begin at 0."""


@dataclass(frozen=True)
class Args(Checked):
    """Draws three panels."""

    scene: Positional[Path]
    description: Positional[Path]
    weights: Positional[Path]
    """Directory of the sampler's."""
    out: Path = Path("runs/sampler.png")
    number: Whole = 0
    """From which problem on one is looked for."""
    proposals: Count = 64


def main(args: Args) -> None:
    """Writes the picture."""
    trained = load_sampler(args.weights)
    scene = Scene.from_mjcf(str(args.scene), slots=trained.scene["slots"])
    planner = Planner(scene)
    cell, number = Cell(planner, read_json(args.description)), args.number
    problem = cell.draw(SEED, number)
    while straight_is_free(planner, problem):
        number += 1
        problem = cell.draw(SEED, number)
    rng = np.random.default_rng(0)
    low, high = planner.q_min, planner.q_max
    uniform = rng.uniform(low, high, (args.proposals, len(low)))
    weights = trained.bank.weights
    fresh = jax.tree.map(
        np.asarray, init(weights.config, jax.random.key(0), training=False)
    )
    untrained = SceneSampler(weights._replace(params=fresh))
    ends = {
        "uniform": uniform,
        "learned, before training": proposed(untrained, scene, problem, args.proposals),
        "learned": proposed(trained, scene, problem, args.proposals),
    }
    panels = [panel(scene, problem, q) for q in ends.values()]
    legend = [Key("dot", PROPOSAL, "a proposal"), Key("cross", SUBGOAL, "the goal")]
    args.out.parent.mkdir(parents=True, exist_ok=True)
    sheet([panels], [list(ends)], legend).save(args.out)
    print(f"problem {number}; written to {args.out}")


def straight_is_free(planner: Planner, problem: Problem) -> bool:
    """Whether there is nothing to search for."""
    share = np.linspace(0, 1, 200)[:, None]
    q = problem.q_start + share * (np.asarray(problem.goal) - problem.q_start)
    return bool((planner.clearance(q, problem.world) > 0).all())


def proposed(
    sampler: SceneSampler, scene: Scene, problem: Problem, count: int
) -> np.ndarray:
    """`[count, d]` ends of segments, within the limits."""
    start, goal = (
        np.asarray(q, np.float32)[None] for q in (problem.q_start, problem.goal)
    )
    keys = jax.random.split(jax.random.key(1), 1)
    draw = sampler.for_scene(scene)(start, goal, keys, problem.world)
    found, number = [], 0
    while sum(map(len, found)) < count:
        found.append(np.asarray(draw(jnp.array([number])).end[0]))
        number += 1
    low, high = np.asarray(scene.q_min), np.asarray(scene.q_max)
    return np.concatenate(found)[:count].clip(low, high)


def panel(scene: Scene, problem: Problem, q: np.ndarray) -> Image.Image:
    """The scene at the start, with where configurations `[N, d]` bring the hand."""
    model = mujoco_model(scene)
    fill(scene, model, problem.world)
    model.vis.quality.shadowsize, model.vis.quality.offsamples = 2048, 2
    data = mujoco.MjData(model)
    world = jax.tree.map(lambda leaf: np.asarray(leaf)[None], problem.world)
    data.qpos[:] = qpos_rows(scene, world, problem.q_start[None])[0]
    mujoco.mj_forward(model, data)
    every = jnp.concatenate([q, np.asarray(problem.goal)[None]])
    hand = np.asarray(frame_pose(scene, problem.world, every, scene.hand))[..., 3]
    around = np.concatenate([hand, [[0.0, 0.0, 0.0]]])
    view = fitting_view(around.min(0), around.max(0), model.vis.global_.fovy)
    camera = Camera(model, HEIGHT, WIDTH)
    picture = Image.fromarray(camera.render(data, view))
    marks = tuple(Mark(place, "dot", PROPOSAL) for place in hand[:-1])
    marks += (Mark(hand[-1], "cross", SUBGOAL),)
    return marked(picture, marks, camera.project(hand), 1)


if __name__ == "__main__":
    run_script(main, Args)
