"""Where each policy fails: `python eval/failures.py --out docs/figures/imitation.png`.

Reads what `eval/imitation.py` found: a bar of failures by kind for each agent, and below it a
strip of a typical failure, the first seed of the most frequent kind, run once more.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pictures.sheet import GAP, INK, LINE, PAPER, sheet, small
from PIL import Image, ImageDraw

from jaxplan.base import Phase
from jaxplan.cli import run_script
from jaxplan.config import from_dict
from jaxplan.episodes import run_episodes
from jaxplan.evaluation.imitation import ImitationConfig
from jaxplan.pictures.painter import Moment, Painter
from jaxplan.policies import POLICIES, PolicyAgent
from jaxplan.pretrained import load_weights
from jaxplan.ranges import Checked

WIDTH, BAR, NAME = 1500, 28, 190
"""Of the page, height of a bar, and width of its name [px]."""
PANELS = 6
SOLVED = (222, 228, 222)
COLORS = (
    (213, 94, 0),
    (0, 114, 178),
    (204, 121, 167),
    (230, 159, 0),
    (0, 158, 115),
    (86, 180, 233),
    (120, 120, 120),
)
"""Of kinds, in the order of their frequency: Okabe and Ito's, told apart by all eyes."""


@dataclass(frozen=True)
class Args(Checked):
    """Draws what a comparison found."""

    result: Path = Path("eval/results/imitation_plain.json")
    policies: Path = Path("weights/policies")
    """Directory with the policies' weights."""
    out: Path = Path("runs/imitation.png")


def main(args: Args) -> None:
    """Draws the page."""
    found = json.loads(args.result.read_text(encoding="utf-8"))
    study = from_dict(ImitationConfig, found["config"])
    parts = [bars(found["policies"])]
    for name, row in found["policies"].items():
        kind = typical(row)
        seeds = [e["seed"] for e in row["episodes"] if e["kind"] == kind]
        if name in POLICIES and seeds:
            panels = strip(study, name, args.policies, seeds[0])
            captions = [f"{name}, seed {seeds[0]}"] + [""] * (PANELS - 2)
            captions.append(kind)
            width = (WIDTH - GAP) // PANELS - GAP
            page = sheet([panels], [captions], width=width, letters=False)
            parts.append(page)
    page = Image.new("RGB", (WIDTH, sum(part.height for part in parts)), PAPER)
    top = 0
    for part in parts:
        page.paste(part, (0, top))
        top += part.height
    args.out.parent.mkdir(parents=True, exist_ok=True)
    small(page).save(args.out, optimize=True)
    print(f"written to {args.out}")


def typical(row: Mapping[str, Any]) -> str:
    """The most frequent kind of failure, '' where there is none."""
    return max(row["failures"], key=row["failures"].get, default="")


def bars(rows: Mapping[str, Mapping[str, Any]]) -> Image.Image:
    """A bar an agent: its episodes, by how they ended."""
    total: dict[str, int] = {}
    for row in rows.values():
        for kind, count in row["failures"].items():
            total[kind] = total.get(kind, 0) + count
    kinds = sorted(total, key=lambda kind: -total[kind])
    colors = {kind: COLORS[i % len(COLORS)] for i, kind in enumerate(kinds)}
    page = Image.new("RGB", (WIDTH, GAP + (len(rows) + 1) * (BAR + GAP) + LINE), PAPER)
    draw = ImageDraw.Draw(page)
    for i, (name, row) in enumerate(rows.items()):
        top, left = GAP + i * (BAR + GAP), float(NAME)
        draw.text((GAP, top + 4), name, INK, font_size=18)
        parts = [("", row["successes"], SOLVED)]
        parts += [(kind, row["failures"].get(kind, 0), colors[kind]) for kind in kinds]
        for kind, count, color in parts:
            right = left + (WIDTH - NAME - GAP) * count / row["trials"]
            if count:
                draw.rectangle((left, top, right, top + BAR), color)
            if right - left > 40:
                text = f"{count}" if kind else f"{count} of {row['trials']} succeed"
                ink = PAPER if kind else INK
                draw.text((left + 6, top + 5), text, ink, font_size=16)
            left = right
    x, y = float(NAME), GAP + len(rows) * (BAR + GAP)
    for kind in kinds:
        draw.rectangle((x, y + 3, x + 14, y + 17), colors[kind])
        draw.text((x + 20, y), kind, INK, font_size=16)
        x += 44 + draw.textlength(kind, font_size=16)
    return page


def strip(
    study: ImitationConfig, name: str, weights: Path, seed: int
) -> list[Image.Image]:
    """An episode of a policy, evenly from its start to its end."""
    task = study.load(1)
    agent = PolicyAgent(task, load_weights(name, weights))
    paint = Painter(task, "near")
    moments: list[Moment] = []

    def listen(phase: Phase) -> None:
        seen = phase.observation.images[task.camera][0]
        moments.append(paint.now(0)._replace(seen=seen))

    run_episodes(task, agent, [seed], study.episode, [listen])
    moments.append(paint.now(0))
    chosen = np.linspace(0, len(moments) - 1, PANELS).round().astype(int)
    return [paint.picture(moments[i]) for i in chosen]


if __name__ == "__main__":
    run_script(main, Args)
