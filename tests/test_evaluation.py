"""What the scripts in `eval/` share: intervals, seeds, toggle errors."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from jaxplan.episodes import EpisodeRecord
from jaxplan.evaluation import parse_seeds, versions, wilson
from jaxplan.evaluation.toggle_error import ToggleError, ToggleErrors, summarize


def test_wilson_agrees_with_known_values():
    assert wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)


@given(st.integers(1, 1000), st.data())
def test_wilson_agrees_with_scipy(trials, data):
    successes = data.draw(st.integers(0, trials))
    expected = binomtest(successes, trials).proportion_ci(method="wilson")
    assert wilson(successes, trials) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("trials", [1, 34, 126, 1000])
def test_of_none_and_of_all_a_bound_is_exact(trials):
    assert wilson(0, trials)[0] == 0
    assert wilson(trials, trials)[1] == 1


def test_an_interval_of_nothing_is_refused():
    with pytest.raises(ValueError, match="at least one"):
        wilson(0, 0)


def test_seed_ranges():
    assert parse_seeds("100000:100100") == range(100000, 100100)
    assert parse_seeds("7") == range(7, 8)


@pytest.mark.parametrize(
    "text", ["", ":", "5:", ":5", "a:b", "1.5", "1:2:3", "5:5", "9:3", "-3:2", "0:2147483649"]
)  # fmt: skip
def test_seed_ranges_that_make_no_sense_are_refused(text):
    with pytest.raises(ValueError, match="FIRST:END") as error:
        parse_seeds(text)
    assert repr(text) in str(error.value)


def test_toggle_errors_are_summed_up_per_toggle():
    errors = [
        ToggleError(toggle=0, error=0.01, nearest=0.01),
        ToggleError(toggle=0, error=0.03, nearest=0.02),
        ToggleError(toggle=0, error=0.11, nearest=0.03),
        ToggleError(toggle=3, error=0.05, nearest=0.04),
    ]
    summary = summarize(errors)
    assert list(summary["per_toggle"]) == ["grasp1", "release2"]
    first = summary["per_toggle"]["grasp1"]
    assert first == pytest.approx({"mean": 0.05, "median": 0.03, "phases": 3})
    assert summary["mean"] == pytest.approx(0.05)
    assert summary["median"] == pytest.approx(0.04)
    assert summary["nearest_toggle_mean"] == pytest.approx(0.025)
    assert summarize([]) == {}


def test_the_nearest_toggle_is_any_of_the_episode():
    """The hand says the second toggle, then the first: each is an episode's, neither the next."""
    toggles = np.array([[0.0, 0.0], [3.0, 4.0]])
    task: Any = SimpleNamespace(
        closed=[False],
        held=lambda lane: False,
        in_terminal_region=lambda lane: False,
        keyframes=lambda lane, q: SimpleNamespace(
            toggle=int(q[0]), q=toggles[[int(q[0])]]
        ),
    )
    errors = ToggleErrors(task)
    for phase, said in enumerate((toggles[1] + [0.0, 0.1], toggles[0] + [0.2, 0.0])):
        subgoal = SimpleNamespace(q_toggle=[said])
        decision = SimpleNamespace(backing=[], subgoal=subgoal)
        seen: Any = SimpleNamespace(
            lanes=[0],
            action=SimpleNamespace(decision=decision),
            observation=SimpleNamespace(q=[[phase]]),
        )
        errors(seen)
    first, second = errors.finish()
    assert first.error == pytest.approx(np.hypot(3.0, 4.1))
    assert second.error == pytest.approx(np.hypot(2.8, 4.0))
    assert (first.nearest, second.nearest) == pytest.approx((0.1, 0.2))
    assert errors.finish() == []


def test_an_episode_that_never_moved_is_a_record_too():
    episode = EpisodeRecord(5, False, "outside", []).as_json()
    assert episode["expansions"] == episode["planning_seconds"] == 0
    assert episode["failure"] == "outside"


def test_versions_name_what_computes():
    assert {"jaxplan", "jax", "mujoco", "mujoco-mjx", "machine"} <= set(versions())
