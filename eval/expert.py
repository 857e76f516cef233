"""The expert over seeds, and its planning problems certified by C MuJoCo.

    python eval/expert.py --seeds 0:200 --out runs/expert.json

Every seed counts. The problems that the episodes pose (about 14 each) are planned as for
demonstrations; each path and each executed motion is then judged by C MuJoCo.
"""

from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from jaxplan import tasks
from jaxplan.cli import run_script
from jaxplan.demonstrations import ExpertAgent
from jaxplan.demonstrations.expert import CLEAN
from jaxplan.episodes import run_episodes
from jaxplan.evaluation import parse_seeds, wilson
from jaxplan.evaluation.certification import Certification
from jaxplan.evaluation.result import write_result
from jaxplan.ranges import Checked, Count


@dataclass(frozen=True)
class Args(Checked):
    """Runs the scripted expert without noise."""

    seeds: str = "0:200"
    out: Path = Path("runs/expert.json")
    batch: Count = 32
    task: str = tasks.DEFAULT
    variant: str = "plain"
    objects: str = tasks.ONE
    """Which mugs: one, train, held_out."""


def main(args: Args) -> None:
    """Runs, prints, writes JSON."""
    seeds = parse_seeds(args.seeds)
    batch = min(args.batch, len(seeds))
    task = tasks.load(args.task, batch, args.variant, objects=args.objects)
    expert = ExpertAgent(task, CLEAN)
    certification = Certification(expert.planner, task.planning_scene)
    records = []
    with tqdm(total=len(seeds), unit="episode") as bar:
        for first in range(0, len(seeds), task.batch):
            part = seeds[first : first + task.batch]
            records += run_episodes(task, expert, part, listeners=[certification])
            bar.update(len(part))
    successes = sum(record.success for record in records)
    result = {
        "success_rate": successes / len(records),
        "wilson_95": wilson(successes, len(records)),
        "planning": certification.summary(),
        "episodes": [record.as_json() for record in records],
        "variant": args.variant,
        "objects": args.objects,
    }
    write_result(args.out, result)
    print(f"expert: {successes}/{len(records)} episodes")
    for record in records:
        if not record.success:
            print(f"  seed {record.seed}: {record.failure}")
    for key, value in result["planning"].items():
        print(f"  {key}: {value}")
    print(f"written to {args.out}")


if __name__ == "__main__":
    run_script(main, Args)
