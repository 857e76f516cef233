"""What the interface of policies costs: `python eval/replay.py data/timed_camera --seeds 0:256`.

The expert's recorded actions once more, without a network, in episodes of the same seeds. Where
these fail no policy can be blamed.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

from tqdm import tqdm
from tyro.conf import Positional

from jaxplan import data
from jaxplan.cli import run_script
from jaxplan.data import TimedShard
from jaxplan.evaluation import parse_seeds
from jaxplan.evaluation.imitation import ImitationConfig, evaluate_agent
from jaxplan.evaluation.memo import Memo
from jaxplan.evaluation.result import write_result
from jaxplan.policies.replay import Replay
from jaxplan.ranges import Checked


@dataclass(frozen=True)
class Args(Checked):
    """Replays demonstrations."""

    demonstrations: Positional[Path]
    """Directory that `train/collect_demos.py --timed` wrote."""
    seeds: str = "0:256"
    """FIRST:END, END excluded, of what was demonstrated."""
    out: Path = Path("runs/replay.json")
    study: ImitationConfig = ImitationConfig(max_actions=300)


def main(args: Args) -> None:
    """Evaluates, writes JSON, prints a line."""
    shard = data.read_demonstrations(args.demonstrations, TimedShard)
    solved = {*shard.episode_seed[shard.episode_success].tolist()}
    seeds = [seed for seed in parse_seeds(args.seeds) if seed in solved]
    if not seeds:
        raise ValueError(f"no solved episode of {args.seeds} in {args.demonstrations}")
    study = args.study
    task = study.load(study.batch)
    digest = data.sha256(args.demonstrations / data.MANIFEST)
    settings = {"agent": "replay", "study": asdict(study), "data": digest}
    agent = Replay(task, shard._replace(image=shard.seed))
    with tqdm(total=len(seeds), unit="episode") as bar:
        row = evaluate_agent(
            task, agent, 1, seeds, study.episode, settings, Memo(), bar.update
        )
    write_result(args.out, {"replay": row, "config": asdict(study)})
    low, high = (100 * x for x in row["wilson_95"])
    print(
        f"{row['successes']} of {row['trials']} solved episodes again "
        f"({low:.1f} to {high:.1f} %); {row['failures']}"
    )


if __name__ == "__main__":
    run_script(main, Args)
