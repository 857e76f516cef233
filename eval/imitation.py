"""Table 1: `python eval/imitation.py --seeds 100000:100300 --out imitation.json`.

The method and the imitation policies in the same episodes, with the same pictures and the same
judge. A killed run goes on after the batches that it has finished (`runs/pieces`).
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from parts.imitation_tables import tables
from tqdm import tqdm

from jaxplan import tasks
from jaxplan.algorithm1 import Algorithm1
from jaxplan.cli import run_script
from jaxplan.config import EXECUTED_TRAJECTORY, PAPER_PLANNER
from jaxplan.episodes import EpisodeConfig
from jaxplan.evaluation import parse_seeds
from jaxplan.evaluation.imitation import (
    ImitationConfig,
    evaluate_agent,
    settings_of,
)
from jaxplan.evaluation.memo import Memo
from jaxplan.evaluation.result import write_result
from jaxplan.evaluation.statistics import mcnemar
from jaxplan.evaluation.tables import markdown
from jaxplan.learned import learned
from jaxplan.motion import MotionPlanner
from jaxplan.policies import POLICIES, PolicyAgent
from jaxplan.pretrained import load_pair, load_weights, shipped
from jaxplan.ranges import Checked

OURS = "ours"


@dataclass(frozen=True)
class Args(Checked):
    """Runs the method and the policies on each seed."""

    seeds: str = "100000:100300"
    """FIRST:END, END excluded. No weights ever saw seeds from 100000 on."""
    out: Path = Path("runs/imitation.json")
    agents: tuple[str, ...] = (OURS, *POLICIES)
    """Whose episodes run."""
    weights: Path | None = None
    """Directory with predictor, sampler and manifest; None = those shipped for the scene."""
    policies: Path = Path("weights/policies")
    """Directory with the policies' weights."""
    quick: bool = False
    """Four seeds, and half a minute an episode: to see that everything runs."""
    study: ImitationConfig = ImitationConfig()


def main(args: Args) -> None:
    """Evaluates, writes JSON, prints the tables."""
    seeds, study = parse_seeds(args.seeds), args.study
    if args.quick:
        seeds, study = seeds[:4], replace(study, max_actions=300)
    study = replace(study, batch=min(study.batch, len(seeds)))
    tasks.check(study.task, study.variant)
    if unknown := set(args.agents) - {OURS, *POLICIES}:
        known = ", ".join((OURS, *POLICIES))
        raise ValueError(f"agent {min(unknown)!r}: there is {known}")
    place = args.weights or shipped(study.variant)
    networks: dict[str, Any] = {
        name: load_pair(place) if name == OURS else (load_weights(name, args.policies),)
        for name in args.agents
    }
    task = study.load(study.batch)
    rows: dict[str, Any] = {}
    for name, weights in networks.items():
        if name == OURS:
            planner = MotionPlanner(
                task.planning_scene,
                task.robot.limits,
                PAPER_PLANNER,
                EXECUTED_TRAJECTORY,
            )
            agent: Any = Algorithm1(task, planner, *learned(task, weights))
            every, episode = 1, EpisodeConfig()
        else:
            agent = PolicyAgent(task, weights[0])
            every, episode = agent.config.executed, study.episode
        with tqdm(total=len(seeds), unit="episode", desc=name) as bar:
            rows[name] = evaluate_agent(
                task,
                agent,
                every,
                seeds,
                episode,
                settings_of(study, weights) | {"agent": name},
                Memo(),
                bar.update,
            )
    paired = {
        f"{one} / {other}": mcnemar(_successes(rows[one]), _successes(rows[other]))
        for k, one in enumerate(rows)
        for other in list(rows)[k + 1 :]
    }
    shown = tables(study.variant, rows, paired)
    found = {
        "policies": rows,
        "paired": paired,
        "config": asdict(study),
        "weights": [w.info["sha256"] for each in networks.values() for w in each],
        "tables": [asdict(each) for each in shown],
        "quick": args.quick,
    }
    write_result(args.out, found)
    for each in shown:
        print(f"\n{each.title}\n\n{markdown(each)}")


def _successes(row: dict[str, Any]) -> list[bool]:
    return [episode["success"] for episode in row["episodes"]]


if __name__ == "__main__":
    run_script(main, Args)
