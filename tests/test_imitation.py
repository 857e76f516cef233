"""Table 1: agents over the same seeds, and the tables and pictures of what they did."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / "eval"))

from failures import COLORS, SOLVED, bars, typical
from parts.imitation_tables import PAPER, tables
from parts.summary import imitation

from jaxplan.episodes import EpisodeConfig
from jaxplan.evaluation.imitation import evaluate_agent, summary
from jaxplan.evaluation.memo import Memo
from jaxplan.evaluation.statistics import mcnemar
from jaxplan.policies import Drive, Step


def piece(*kinds: str | None, table: int = 0) -> dict:
    """A finished batch, an episode a kind of failure."""
    episodes = [
        {
            "seed": seed,
            "success": kind is None,
            "kind": kind,
            "clipped": seed,
            "collisions": {"table": table, "others": 0},
        }
        for seed, kind in enumerate(kinds)
    ]
    return {"episodes": episodes, "seconds": 0.5, "decisions": 10}


ROWS = {
    "ours": summary([piece(None, None), piece(None)]),
    "lstm_gmm": summary(
        [piece(None, "dropped", table=1), piece("dropped", "missed rim")]
    ),
}


def test_batches_are_summed_up():
    row = ROWS["lstm_gmm"]
    assert (row["successes"], row["trials"], row["success_rate"]) == (1, 4, 0.25)
    assert row["failures"] == {"dropped": 2, "missed rim": 1}
    assert row["collisions"] == {"with_table": 2, "with_box": 0, "episodes": 2}
    assert row["clipped"] == 0 + 1 + 0 + 1
    assert row["seconds_per_decision"] == pytest.approx(0.05)


def test_tables_and_the_summary_say_what_was_counted():
    paired = {"ours / lstm_gmm": mcnemar([True] * 4, [True, False, False, False])}
    success, failures, tests = tables("plain", ROWS, paired)
    assert success.rows[1][1][0] == 25.0
    assert success.rows[1][2] == PAPER["lstm_gmm"]
    assert success.rows[1][3] == 50.0
    assert failures.columns == ["", "dropped", "missed rim"]
    assert failures.rows == [["ours", 0, 0], ["lstm_gmm", 2, 1]]
    assert tests.rows == [["ours / lstm_gmm", 3, 0, "0.25"]]
    short = imitation({"imitation_plain": {"policies": ROWS}})
    assert short.columns == ["success, %", "plain", "paper"]
    assert [row[1][0] for row in short.rows] == [100.0, 25.0]


def test_a_bar_is_as_long_as_its_share():
    assert typical(ROWS["lstm_gmm"]) == "dropped"
    assert typical(ROWS["ours"]) == ""
    page = np.asarray(bars(ROWS))
    row = page[10 + 38 + 2]
    solved, dropped, missed = (
        (row == color).all(-1).sum() for color in (SOLVED, *COLORS[:2])
    )
    assert solved == pytest.approx(dropped / 2, rel=0.05)
    assert missed == pytest.approx(dropped / 2, rel=0.05)


class Statue:
    """Has the arms stay where they are."""

    def __init__(self, task) -> None:
        self._drive, self.asked = Drive(task), 0

    def reset(self, seeds):
        self._drive.reset()

    def act(self, number, lanes, observation):
        self.asked += 1
        step = Step(observation.q + 0.001 * (number + 1), observation.gripper)
        return self._drive.action(lanes, observation, step)

    def obstacle(self, lane):
        return "it is a statue"


def test_an_agent_is_judged_and_a_killed_run_goes_on(mug_task, tmp_path):
    agent, done = Statue(mug_task), []

    def run():
        return evaluate_agent(
            mug_task,
            agent,
            2,
            range(6),
            EpisodeConfig(max_phases=4, max_stuck=50),
            {"agent": "statue"},
            Memo(tmp_path),
            done.append,
        )

    first = run()
    assert done == [4, 2], "a batch of four lanes, and a short one"
    assert (first["successes"], first["trials"]) == (0, 6)
    assert sum(first["failures"].values()) == 6
    assert [episode["seed"] for episode in first["episodes"]] == list(range(6))
    assert first["seconds_per_decision"] > 0
    asked = agent.asked
    assert run() == first
    assert agent.asked == asked, "what is finished is not run again"
    assert mug_task.sim.record is None
