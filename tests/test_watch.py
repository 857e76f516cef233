"""Failures by kind, from how mug and gripper stood at each round."""

import pytest

from jaxplan.tasks.mug.watch import Seen, kind
from jaxplan.tasks.watch import kind_of

LYING = Seen(closed=False, held=False, upright=False)
RIM = Seen(closed=True, held=True, upright=False)
STANDING = Seen(closed=False, held=False, upright=True)
HANDLE = Seen(closed=True, held=True, upright=True)
EMPTY = Seen(closed=True, held=False, upright=False)
LATE = "not finished after 24 phases"


@pytest.mark.parametrize(
    ("seen", "failure", "expected"),
    [
        ([LYING, RIM, STANDING, HANDLE, STANDING], None, None),
        ([LYING, LYING], "no motion in phase 2: GOAL_IN_COLLISION", "no motion"),
        ([LYING, EMPTY, EMPTY], LATE, "missed rim"),
        ([LYING, LYING], LATE, "not finished"),
        ([LYING, RIM, EMPTY], LATE, "dropped"),
        ([LYING, RIM, LYING, LYING], LATE, "knocked over"),
        ([LYING, RIM, STANDING, EMPTY._replace(upright=True)], LATE, "missed handle"),
        ([LYING, RIM, STANDING, HANDLE, EMPTY], LATE, "dropped"),
        (
            [LYING, RIM, STANDING, HANDLE, STANDING],
            "the mug is outside the box",
            "missed box",
        ),
        (
            [LYING, RIM, STANDING, HANDLE, LYING],
            "the mug is not upright",
            "knocked over",
        ),
        ([LYING, RIM, STANDING], "the mug is outside the box", "missed handle"),
        ([LYING], "the mug came to rest outside the range", "the mug came to rest"),
    ],
)
def test_kinds(seen, failure, expected):
    found = kind(seen, failure)
    assert found == expected or (found or "").startswith(str(expected))


def test_words_without_what_is_special():
    assert kind_of("no motion in phase 3: TIME_OUT; nearest") == "no motion"
    assert kind_of(LATE) == "not finished"
    assert kind_of("not lifted") == "not lifted"
    assert kind_of(None) is None
