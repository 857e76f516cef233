"""Imitation policies over seeds, and the whole method beside them: Table 1."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from jaxplan import tasks
from jaxplan.base import Action, Agent, Observation
from jaxplan.episodes import EpisodeConfig, run_episodes
from jaxplan.evaluation.memo import Memo, code_digest
from jaxplan.evaluation.statistics import wilson
from jaxplan.ranges import Checked, Count
from jaxplan.tasks import Tabletop
from jaxplan.tasks.bumps import BumpWatch
from jaxplan.tasks.perturbation import NOMINAL, Perturbation


@dataclass(frozen=True)
class ImitationConfig(Checked):
    """What runs."""

    task: str = tasks.DEFAULT
    variant: str = "plain"
    camera: str = "hand"
    batch: Count = 32
    """Episodes in lockstep."""
    max_actions: Count = 600
    """A minute, without the time that grippers take: four times what the expert needs."""
    max_still: Count = 50
    """Actions in a row that move nothing."""
    perturbation: Perturbation = NOMINAL
    """What varies in the pictures."""

    def load(self, batch: int) -> Tabletop:
        """The simulated world, for so many episodes in lockstep."""
        return tasks.load(
            self.task,
            batch,
            self.variant,
            self.camera,
            perturbation=self.perturbation,
        )

    @property
    def episode(self) -> EpisodeConfig:
        """When an episode of a policy is given up."""
        return EpisodeConfig(max_phases=self.max_actions, max_stuck=self.max_still)


class Stopwatch:
    """An agent whose decisions are timed; the first one, which compiles, is not."""

    def __init__(self, agent: Agent, every: int) -> None:
        self._agent, self._every = agent, every
        self.seconds, self.decisions = 0.0, 0

    def reset(self, seeds: Sequence[int]) -> None:
        """Begins a batch of episodes."""
        self._agent.reset(seeds)

    def act(self, number: int, lanes: list[int], observation: Observation) -> Action:
        """As the agent; a decision is made every so many rounds."""
        start = time.perf_counter()
        action = self._agent.act(number, lanes, observation)
        if number:
            self.seconds += time.perf_counter() - start
            self.decisions += len(lanes) * (number % self._every == 0)
        return action

    def obstacle(self, lane: int) -> str:
        """Why the last action moved nothing."""
        return self._agent.obstacle(lane)


def evaluate_agent(
    task: Tabletop,
    agent: Agent,
    every: int,
    seeds: Sequence[int],
    episode: EpisodeConfig,
    settings: dict[str, Any],
    memo: Memo,
    progress: Callable[[int], object] = lambda done: None,
) -> dict[str, Any]:
    """Runs one episode a seed.

    Args:
        task: The simulated world.
        agent: Who acts.
        every: It decides in every so many rounds.
        seeds: Episodes.
        episode: When one is given up.
        settings: All that decides how episodes go, for `memo`.
        memo: Keeps finished batches.
        progress: Called with the number of episodes of each finished batch.

    Returns:
        JSON-ready: success_rate, wilson_95, successes, trials, failures by kind, collisions,
        clipped actions, seconds_per_decision, and a line an episode.
    """
    bumps, watch = BumpWatch(task), task.watch()

    def piece(part: Sequence[int]) -> dict[str, Any]:
        timed = Stopwatch(agent, every)
        records = run_episodes(task, timed, part, episode, [watch])
        hit = bumps.finish(range(len(part)))
        rows = zip(records, watch.finish(records), hit, strict=True)
        return {
            "episodes": [
                {
                    "seed": record.seed,
                    "success": record.success,
                    "failure": record.failure,
                    "kind": kind,
                    "rounds": len(record.phases),
                    "clipped": sum(phase.get("clipped", 0) for phase in record.phases),
                    "collisions": bump._asdict(),
                }
                for record, kind, bump in rows
            ],
            "seconds": timed.seconds,
            "decisions": timed.decisions,
        }

    pieces = []
    for first in range(0, len(seeds), task.batch):
        part = [int(seed) for seed in seeds[first : first + task.batch]]
        key = settings | {"seeds": part, "code": code_digest(("",))}
        pieces.append(memo(key, partial(piece, part)))
        progress(len(part))
    task.sim.record = None
    return summary(pieces)


def summary(pieces: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Of finished batches."""
    episodes = [episode for piece in pieces for episode in piece["episodes"]]
    successes = sum(episode["success"] for episode in episodes)
    decisions = sum(piece["decisions"] for piece in pieces)
    seconds = sum(piece["seconds"] for piece in pieces)
    kinds = Counter(e["kind"] for e in episodes if not e["success"])
    hit = [episode["collisions"] for episode in episodes]
    return {
        "success_rate": successes / len(episodes),
        "wilson_95": list(wilson(successes, len(episodes))),
        "successes": successes,
        "trials": len(episodes),
        "failures": dict(kinds.most_common()),
        "collisions": {
            "with_table": sum(each["table"] for each in hit),
            "with_box": sum(each["others"] for each in hit),
            "episodes": sum(each["table"] + each["others"] > 0 for each in hit),
        },
        "clipped": sum(episode["clipped"] for episode in episodes),
        "seconds_per_decision": seconds / max(1, decisions),
        "episodes": episodes,
    }


def settings_of(config: ImitationConfig, weights: Sequence[Any]) -> dict[str, Any]:
    """What decides how the episodes of some networks go."""
    return {
        "study": asdict(config),
        "weights": [network.info.get("sha256") for network in weights],
    }
