"""What the studies on recorded problems share: their settings, problems and weights."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from tqdm import tqdm

from jaxplan import tasks
from jaxplan.config import PlannerConfig
from jaxplan.evaluation.memo import PLANNING, SAMPLING, Memo, code_digest
from jaxplan.evaluation.problems import RecordedProblems
from jaxplan.evaluation.recording import SHARD, record
from jaxplan.evaluation.searches import Answers, KeptBanks, Searcher, conditions
from jaxplan.evaluation.seeds import parse_seeds
from jaxplan.learning import NoWeights, Weights
from jaxplan.networks import Cond
from jaxplan.pretrained import UPPER, load_weights, shipped
from jaxplan.ranges import Checked
from jaxplan.samplers import FAMILIES, Bank
from jaxplan.samplers.bank import SIZE

RESULTS = Path("eval/results")
PIECE = 1024
"""Problems of a piece that is kept as soon as it is done."""


def results(quick: bool) -> Path:
    """Where a script's JSON goes, so that a quick run does not replace what was measured."""
    return Path("runs") if quick else RESULTS


@dataclass(frozen=True)
class StudyArgs(Checked):
    """What problems, whose weights, where to."""

    task: str = tasks.DEFAULT
    variant: str = "plain"
    """Of the task's scene."""
    seeds: str = "300000:300500"
    """FIRST:END, one trial each; training never saw seeds from 100000 on."""
    upper: Literal["expert", "network"] = "expert"
    """Who says where phases lead. The expert's problems depend on the seeds alone."""
    weights: Path | None = None
    """Directory with the predictor and the samplers; by default the shipped ones."""
    quick: bool = False
    """Few seeds, the same code."""
    out: Path | None = None
    """JSON; by default in `eval/results`, of a quick run in `runs`."""

    @property
    def range(self) -> range:
        """The seeds."""
        seeds = parse_seeds(self.seeds)
        return seeds[:32] if self.quick else seeds

    def path(self, name: str) -> Path:
        """Where the JSON goes."""
        return self.out or results(self.quick) / f"{name}_{self.variant}.json"


class RecordedStudy:
    """Recorded problems of successful episodes, and answers to them that are kept.

    Args:
        args: Settings.
        memo: Where pieces are kept.
    """

    def __init__(self, args: StudyArgs, memo: Memo | None = None) -> None:
        self.args = args
        self.directory = args.weights or shipped(args.variant)
        self.memo = memo or Memo()
        self.predictor = load_weights(UPPER, self.directory)
        upper = self.predictor if args.upper == "network" else None
        with tqdm(total=len(args.range), unit="episode", desc="problems") as bar:
            self.task = tasks.load(args.task, SHARD, args.variant)
            recorded, self.name = record(
                self.task, args.variant, args.range, upper, progress=bar.update
            )
        self.trials = len(args.range)
        self.problems: RecordedProblems = recorded.take(
            np.flatnonzero(recorded.success)
        )
        self.scene = self.task.planning_scene
        self._weights: dict[str, Weights | None] = {}
        self._cond: Cond | None = None
        self._banks: dict[Any, KeptBanks] = {}
        self._searchers: dict[PlannerConfig, Searcher] = {}

    def weights(self, name: str) -> Weights | None:
        """A network's weights, read once, or None where the directory has none of that name."""
        if name not in self._weights:
            try:
                self._weights[name] = load_weights(name, self.directory)
            except NoWeights:
                self._weights[name] = None
        return self._weights[name]

    def settings(self) -> dict[str, Any]:
        """What a result's JSON says of the problems and the weights."""
        found = {name: self.weights(name) for name in (UPPER, *FAMILIES)}
        return {
            "seeds": f"{self.args.range.start}:{self.args.range.stop}",
            "variant": self.args.variant,
            "trials": self.trials,
            "successful_trials": len(np.unique(self.problems.seed)),
            "phases": len(self.problems.seed),
            "blocked_share": float(np.mean(self.problems.blocked)),
            "upper": self.args.upper,
            "weights": {
                name: each and each.info["sha256"] for name, each in found.items()
            },
        }

    def answers(
        self,
        planner: PlannerConfig,
        sampler: Weights | None = None,
        rows: np.ndarray | None = None,
        mask: str = "",
        **changes: Any,
    ) -> Answers:
        """Answers in pieces that are kept.

        Args:
            planner: Settings of the search.
            sampler: A learned sampler.
            rows: Which problems; None = all.
            mask: See `masked`.
            changes: To the sampler's config.
        """
        every = np.arange(len(self.problems.seed)) if rows is None else rows
        settings = {
            "problems": self.name,
            "seeds": [self.args.range.start, self.args.range.stop],
            "planner": dataclasses.asdict(planner),
            "sampler": sampler and sampler.info["sha256"],
            "mask": mask,
            "changes": changes,
            "bank": sampler and SIZE,
            "code": code_digest(SAMPLING if sampler else PLANNING),
        }
        pieces = []
        for first in range(0, len(every), PIECE):
            part = every[first : first + PIECE]

            def make(part=part) -> list[list[int]]:
                banks = sampler and self._bank(sampler, mask, changes)
                found = self._searcher(planner)(self.problems, part, banks)
                return [column.tolist() for column in found]

            pieces.append(self.memo(settings | {"rows": part.tolist()}, make))
        return Answers(*(np.concatenate(c) for c in zip(*pieces, strict=True)))

    @property
    def cond(self) -> Cond:
        """What the samplers are told of each problem."""
        if self._cond is None:
            self._cond = conditions(self.problems, self.predictor)
        return self._cond

    def _bank(self, sampler: Weights, mask: str, changes: dict[str, Any]) -> KeptBanks:
        key = (sampler.info["sha256"], mask, tuple(changes.items()))
        if key not in self._banks:
            cond = masked(self.cond, mask)
            keys = self.problems.keys()
            self._banks[key] = KeptBanks(Bank(sampler, **changes), cond, keys)
        return self._banks[key]

    def _searcher(self, planner: PlannerConfig) -> Searcher:
        if planner not in self._searchers:
            self._searchers[planner] = Searcher(
                self.scene, planner, self.task.robot.limits
            )
        return self._searchers[planner]


def masked(cond: Cond, mask: str) -> Cond:
    """The condition without one of its parts: another part stands in its place.

    Args:
        cond: Of the problems.
        mask: "toggle": the subgoal in the toggle's place, as in a phase that ends at a
            toggle; "subgoal": the toggle in the subgoal's place; "image": features of
            the mean picture; "" = nothing.
    """
    if mask == "toggle":
        return cond._replace(q_toggle=cond.q_goal)
    if mask == "subgoal":
        return cond._replace(q_goal=cond.q_toggle)
    if mask == "image":
        mean = np.broadcast_to(np.mean(cond.image, axis=0), cond.image.shape)
        return cond._replace(image=np.array(mean))  # pyright: ignore
    return cond
