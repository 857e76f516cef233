"""What the reliability figures try, at a small size; and that their trials can fail."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "eval"))

from parts.promises import PROMISES, damage
from parts.promises.damage import Store
from reliability import Promise, attempt

from jaxplan.evaluation.memo import Memo


@pytest.mark.parametrize("promise", damage.PROMISES, ids=lambda p: p.number)
def test_damage_on_disk_is_noticed(promise, tmp_path):
    assert promise.prepare(tmp_path)(range(40)) == []


def test_a_store_that_notices_nothing_is_found_out(tmp_path, monkeypatch):
    plain = Store(
        "plain",
        lambda place: (place / "numbers").write_bytes(bytes(range(100))) and None,
        lambda place: np.frombuffer((place / "numbers").read_bytes(), np.uint8),
    )
    monkeypatch.setattr(damage, "STORES", (plain,))
    (tmp_path / "R10").mkdir()
    flips, cuts, _ = damage.PROMISES
    assert len(flips.prepare(tmp_path / "R10")(range(20))) == 20
    (tmp_path / "R11").mkdir()
    assert "FileNotFoundError" in str(cuts.prepare(tmp_path / "R11")(range(20)))


def test_trials_are_made_once_and_a_figure_is_their_sum(tmp_path):
    tried: list[int] = []

    def prepare(place):
        def trial(numbers):
            tried.extend(numbers)
            return [f"number {n}" for n in numbers if n % 4 == 0]

        return trial

    promise, memo = Promise("R0", "a multiple of 4", 10, 4, prepare), Memo(tmp_path)
    found = attempt(promise, tmp_path, memo, quick=False)
    assert (found.times, found.faults) == (10, ["number 0", "number 4", "number 8"])
    assert attempt(promise, tmp_path, memo, quick=False) == found
    assert tried == list(range(10))


def test_each_promise_has_a_number_of_its_own():
    numbers = [promise.number for promise in PROMISES]
    assert len({*numbers}) == len(numbers)
    assert all(promise.count >= 1 <= promise.piece for promise in PROMISES)
