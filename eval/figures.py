"""The paper's Figures 2 to 5: `python eval/figures.py --out runs/figures`.

    figure2   the first two long phases: toggle, subgoal, and where learned proposals lead
    figure3   one episode in ten panels
    figure4   three initialisations, a column for each of the four toggles
    figure5   the three learned samplers on the same problems, side by side

Blue dots are where the ends of learned segments bring the tool centre point. Uniform proposals are
left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from pictures.sheet import Key, blank, sheet, small
from PIL import Image

from jaxplan import tasks
from jaxplan.base import Phase
from jaxplan.cli import run_script
from jaxplan.evaluation import ClosedLoop, ClosedLoopConfig, parse_seeds
from jaxplan.learned import LearnedProposals
from jaxplan.pictures import painter
from jaxplan.pictures.painter import Moment, Painter
from jaxplan.pretrained import WeightsError, load_pair, load_weights, shipped
from jaxplan.ranges import Checked
from jaxplan.samplers import Bank

SAMPLERS = {"Diffusion (ours)": "sampler", "CVAE": "cvae", "Conditional GAN": "gan"}
TOGGLES = ("rim grasp", "release", "handle grasp", "placing")
NEAR = 0.02
"""A proposal that leads no farther than this from the way that was taken [m] is near it."""


@dataclass(frozen=True)
class Args(Checked):
    """Runs some episodes and draws them."""

    seeds: str = "100000:100008"
    """Episodes to choose from: the first that succeed are drawn."""
    out: Path = Path("runs/figures")
    task: str = tasks.DEFAULT
    variant: str = "plain"
    """Of the task's scene."""
    weights: Path | None = None
    """Directory with predictor, samplers and manifest; by default the shipped ones."""
    figures: tuple[int, ...] = (2, 3, 4, 5)
    quick: bool = False
    """Two episodes."""


class Scene(NamedTuple):
    """A phase of an episode, and what its picture needs."""

    phase: Phase
    lane: int
    stage: int
    """Toggles so far."""
    moment: Moment
    """With the proposals of the sampler that drove."""


class Recorder:
    """Listens to the loop and keeps every phase's picture."""

    def __init__(self, paint: Painter) -> None:
        self._paint = paint
        self.scenes: dict[int, list[Scene]] = {}

    def __call__(self, phase: Phase) -> None:
        """Keeps a round."""
        for e in phase.lanes:
            before = self.scenes.setdefault(e, [])
            gripper = int(phase.observation.gripper[e])
            stage = before[-1].stage if before else 0
            stage += stage % 2 != gripper
            moment = self._paint.moment(phase, e)
            if (draw := phase.action.decision.draw) is not None:
                nodes = self._paint.proposed(phase, e, draw, 96)
                moment = moment._replace(proposals=self._paint.dots(nodes))
            before.append(Scene(phase, e, stage, moment))


def main(args: Args) -> None:
    """Runs the episodes, draws the figures, prints where they are."""
    seeds = parse_seeds(args.seeds)
    seeds = seeds[:2] if args.quick else seeds
    directory = args.weights or shipped(args.variant)
    weights = load_pair(directory)
    config = ClosedLoopConfig(task=args.task, variant=args.variant, batch=len(seeds))
    loop = ClosedLoop(weights, config)
    paint = Painter(loop.task, "above" if loop.task.zones else "near", scale=2)
    recorder = Recorder(paint)
    result = loop.run(seeds, listen=recorder)
    solved = [e for e, row in enumerate(result["episodes"]) if row["success"]]
    if not solved:
        raise ValueError(f"none of the episodes {args.seeds} succeeded: other --seeds?")
    args.out.mkdir(parents=True, exist_ok=True)
    episodes = [recorder.scenes[e] for e in solved]
    end = paint.now(solved[0])
    names = [str(seeds[e]) for e in solved]
    suffix = "" if args.variant == "plain" else f"_{args.variant}"
    for number in args.figures:
        if number == 2:
            page = figure2(paint, episodes[0])
        elif number == 3:
            page = figure3(paint, episodes[0], end)
        elif number == 4:
            page = figure4(paint, episodes[:3], names[:3])
        elif number == 5:
            page = figure5(paint, loop, directory, episodes[0])
        else:
            raise ValueError(f"figure {number}: 2, 3, 4 or 5")
        path = args.out / f"figure{number}{suffix}.png"
        small(page).save(path, optimize=True)
        print(f"written: {path} (seeds {', '.join(names[:3])})")


def figure2(paint: Painter, scenes: Sequence[Scene]) -> Image.Image:
    """Toward the rim grasp, and toward the release."""
    chosen = [_longest(scenes, stage) for stage in (0, 1)]
    captions = ["toward the rim grasp", "toward the release, mug in hand"]
    panels = [paint.picture(scene.moment) for scene in chosen]
    return sheet([panels], [captions], legend(), width=620)


def figure3(paint: Painter, scenes: Sequence[Scene], end: Moment) -> Image.Image:
    """Ten panels from the first grasp to the final placement."""
    stages = [[s for s in scenes if s.stage == stage] for stage in range(4)]
    rim, release, handle, placing = stages
    chosen = [
        (rim[0], "toward the first grasp"),
        (rim[-1], "the subgoal is the toggle"),
        (release[0], "grasped: lift"),
        (release[len(release) // 2], "turn and carry to the release"),
        (handle[0], "released upright: back off"),
        (handle[min(1, len(handle) - 1)], "toward the handle"),
        (handle[-1], "the subgoal is the toggle"),
        (placing[0], "handle grasped: lift"),
        (placing[len(placing) // 2], "toward the box"),
    ]
    panels = [paint.picture(scene.moment) for scene, _ in chosen] + [paint.picture(end)]
    captions = [text for _, text in chosen] + ["in the box"]
    rows = [panels[:5], panels[5:]]
    return sheet(rows, [captions[:5], captions[5:]], legend(), width=360)


def figure4(
    paint: Painter, episodes: Sequence[Sequence[Scene]], seeds: Sequence[str]
) -> Image.Image:
    """Initialisations as rows, the long phase before each toggle as columns."""
    rows = [
        [paint.picture(_longest(scenes, stage).moment) for stage in range(4)]
        for scenes in episodes
    ]
    captions = [[f"seed {seed}"] * 4 for seed in seeds]
    headings = [f"toward {name}" for name in TOGGLES]
    return sheet(rows, captions, legend(), headings, letters=False)


def figure5(
    paint: Painter,
    loop: ClosedLoop,
    directory: Path,
    scenes: Sequence[Scene],
) -> Image.Image:
    """Three long phases, proposed for by each sampler: where there are ways, the last too."""
    stages = (0, 1, 3) if loop.task.zones else (0, 1, 2)
    chosen = [_longest(scenes, stage) for stage in stages]
    rows: list[list[Image.Image]] = [[] for _ in chosen]
    captions: list[list[str]] = [[] for _ in chosen]
    for title, name in SAMPLERS.items():
        try:
            bank = Bank(load_weights(name, directory))
        except WeightsError as error:
            print(f"{title}: {error}")
            for row, caption in zip(rows, captions, strict=True):
                row.append(blank(f"no {name} weights"))
                caption.append("not measured")
            continue
        for row, caption, scene in zip(rows, captions, chosen, strict=True):
            upper, camera = loop.learned.predict, loop.task.camera
            propose = LearnedProposals(bank, upper, camera)
            nodes = _proposals(paint, propose, scene)
            moment = scene.moment._replace(proposals=paint.dots(nodes), seen=None)
            way = _way(paint, scene)
            targets = [mark.position for mark in moment.targets]
            row.append(paint.picture(moment, around=np.array([*way, *targets])))
            ends = np.array([mark.position for mark in moment.proposals])
            gaps = np.linalg.norm(ends[:, None] - way, axis=-1).min(1)
            share = np.mean(gaps < NEAR)
            caption.append(
                f"before the {TOGGLES[scene.stage]}: {share:.0%} within "
                f"{100 * NEAR:.0f} cm of the way taken"
            )
    return sheet(rows, captions, legend(), list(SAMPLERS), width=480, letters=False)


def legend() -> list[Key]:
    """What the marks mean."""
    entries = (
        ("dot", painter.PROPOSAL, "learned proposals"),
        ("cross", painter.SUBGOAL, "subgoal"),
        ("dot", painter.CLOSES, "toggle: close"),
        ("dot", painter.OPENS, "toggle: open"),
    )
    return [Key(shape, color, text) for shape, color, text in entries]


def _longest(scenes: Sequence[Scene], stage: int) -> Scene:
    """The phase of a stage with the longest way to its subgoal."""

    def distance(scene: Scene) -> float:
        phase, e = scene.phase, scene.lane
        q_goal = phase.action.decision.subgoal.q_goal
        return float(np.linalg.norm(q_goal[e] - phase.observation.q[e]))

    return max((s for s in scenes if s.stage == stage), key=distance)


def _proposals(paint: Painter, propose: LearnedProposals, scene: Scene) -> np.ndarray:
    """Nodes `[N, d]` that a sampler proposes for a recorded phase."""
    phase, seen = scene.phase, scene.phase.observation
    keys = jax.vmap(jax.random.key)(jnp.arange(len(seen.q)))
    draw = propose(seen, None, phase.action.decision.subgoal, keys)
    return paint.proposed(phase, scene.lane, draw, 192)


def _way(paint: Painter, scene: Scene) -> np.ndarray:
    """`[N, 3]` where the executed motion brings the tool centre point [m]."""
    motion = scene.phase.action.q[scene.lane]
    return np.stack([paint.tcp(q) for q in motion[::2]])


if __name__ == "__main__":
    run_script(main, Args)
