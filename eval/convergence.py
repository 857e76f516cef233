"""Whether policies are trained to their end: `python eval/convergence.py runs/lstm_gmm ...`.

Success in closed loop of the snapshots that a training leaves behind at each validation, beside
the errors on held-out episodes. Seeds are others than those of Table 1, so that it may be used to
choose by. A killed run goes on after the batches that it has finished (`runs/pieces`).
"""

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from parts.summary import rate
from tqdm import tqdm
from tyro.conf import Positional

from jaxplan.cli import run_script
from jaxplan.evaluation import parse_seeds
from jaxplan.evaluation.imitation import ImitationConfig, evaluate_agent, settings_of
from jaxplan.evaluation.memo import Memo
from jaxplan.evaluation.result import write_result
from jaxplan.evaluation.tables import Table, markdown
from jaxplan.learning import Weights
from jaxplan.policies import POLICIES, PolicyAgent
from jaxplan.pretrained import load_weights
from jaxplan.pretrained.store import networks_in
from jaxplan.ranges import Checked


@dataclass(frozen=True)
class Args(Checked):
    """Runs each snapshot on each seed."""

    runs: Positional[tuple[Path, ...]]
    """Directories of trainings, `runs/NAME`."""
    seeds: str = "150000:150032"
    """FIRST:END, END excluded. Neither trained on nor in any table."""
    out: Path = Path("runs/convergence.json")
    every: int = 1
    """Of how many snapshots one is run; always the last."""
    study: ImitationConfig = ImitationConfig(max_actions=300)


def main(args: Args) -> None:
    """Evaluates, writes JSON, prints a table a run."""
    seeds = parse_seeds(args.seeds)
    study = replace(args.study, batch=min(args.study.batch, len(seeds)))
    task = study.load(study.batch)
    tables: list[Table] = []
    for run in args.runs:
        places = sorted((run / "snapshots").glob("*"))
        if not places:
            raise ValueError(f"{run} has no snapshots: is it a policy's training?")
        metrics = held_out(run / "metrics.jsonl")
        rows = []
        for place in places[:: -args.every][::-1]:
            weights = policy_in(place)
            with tqdm(total=len(seeds), unit="episode", desc=str(place)) as bar:
                found = evaluate_agent(
                    task,
                    PolicyAgent(task, weights),
                    weights.config.executed,
                    seeds,
                    study.episode,
                    settings_of(study, [weights]),
                    Memo(),
                    bar.update,
                )
            step = int(place.name)
            rows.append([step, rate(found), *metrics.get(step, [None] * 3)])
        columns = ["step", "success, %", "loss", "joints [rad]", "toggles, %"]
        tables.append(Table(f"{run.name}, {len(seeds)} episodes", columns, rows))
        print(f"\n{tables[-1].title}\n\n{markdown(tables[-1])}", flush=True)
    found = {"tables": [asdict(table) for table in tables], "config": asdict(study)}
    write_result(args.out, found)


def policy_in(directory: Path) -> Weights:
    """The one policy whose weights lie there."""
    names = [name for name in networks_in(directory) if name in POLICIES]
    if len(names) != 1:
        raise ValueError(f"{directory} has {len(names)} policies")
    return load_weights(names[0], directory)


def held_out(path: Path) -> dict[int, list[Any]]:
    """Loss, mean error of the joints and right toggles [%], by step."""
    found = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        said = json.loads(line)
        if "val_loss" in said:
            toggles = said.get("val_toggle_accuracy")
            share = None if toggles is None else 100 * toggles
            found[said["step"]] = [said["val_loss"], said["val_q_mean"], share]
    return found


if __name__ == "__main__":
    run_script(main, Args)
