"""Joints that cannot come from start to goal: found where they are, and nowhere else."""

import math

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxplan import Planner, PlannerConfig, Scene, Status
from jaxplan.motion.barriers import barrier_between
from jaxplan.planning.space import Space

LIMIT = 2 * math.pi
WIDTH = 0.6
"""Of what is shut: wider than the distance of slices on the longest way."""


def space_of(kinds: tuple[str, ...]) -> Space:
    """Joints that are limited, come round, or go on for ever."""
    circular = np.array([kind == "circular" for kind in kinds])
    limit = np.array([LIMIT if kind == "limited" else np.inf for kind in kinds])
    return Space.of(-limit, limit, circular)


def shut_at(joint: int, places: list[float], comes_round: bool):
    """Free but where a joint is within `WIDTH` / 2 of one of the places."""

    def free(q):
        gap = q[:, joint, None] - jnp.array(places)
        if comes_round:
            gap = gap - 2 * jnp.pi * jnp.round(gap / (2 * jnp.pi))
        return (jnp.abs(gap) > WIDTH / 2).all(1)

    return free


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_a_barrier_is_found_where_it_divides_start_from_all_goals(data):
    kinds = tuple(
        data.draw(
            st.lists(
                st.sampled_from(["limited", "circular", "endless"]),
                min_size=1,
                max_size=4,
            )
        )
    )
    joint = data.draw(st.integers(0, len(kinds) - 1))
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    around = kinds[joint] == "circular"
    places = [float(rng.uniform(-3, 3))]
    if around and data.draw(st.booleans()):
        places.append(places[0] + float(rng.uniform(2, 4)))
    free = shut_at(joint, places, around)
    ends = rng.uniform(-6, 6, (200, len(kinds)))
    q_start, *q_goals = ends[np.asarray(free(ends))][:3]
    goals = np.array(q_goals[: data.draw(st.integers(1, 2))])

    def divided(goal: np.ndarray) -> bool:
        if not around:
            return (
                min(q_start[joint], goal[joint])
                < places[0]
                < max(q_start[joint], goal[joint])
            )
        # Round a circle two places divide, if one of them is on each way.
        start, to, *at = (x % LIMIT for x in (q_start[joint], goal[joint], *places))
        between = [min(start, to) < place < max(start, to) for place in at]
        return any(between) and not all(between)

    gaps = goals[:, joint] - q_start[joint]
    one_side = around or (gaps > 0).all() or (gaps < 0).all()
    found = barrier_between(free, q_start, goals, space_of(kinds))
    if found is None:
        assert not (one_side and all(map(divided, goals)))
    else:
        assert found.joint == joint
        assert all(map(divided, goals))
        assert len(found.positions) == 1 + around
        rows = np.tile(q_start, (len(found.positions), 1))
        rows[:, joint] = found.positions
        assert not np.asarray(free(rows)).any()
        assert not np.asarray(free(found.q)).any()


ARM = """<mujoco><compiler angle="radian"/><worldbody>
  <geom name="post" type="capsule" size=".04" fromto=".2 0 -1 .2 0 1"/>
  {second}
  <body><joint name="pan" type="hinge" axis="0 0 1" {limits}/>
    <geom name="upper" type="capsule" size=".03" fromto="0 0 0 .4 0 0"/>
    <body pos=".4 0 0"><joint name="elbow" axis="0 1 0" range="-2 2"/>
      <geom name="fore" type="capsule" size=".02" fromto="0 0 0 .2 0 0"/></body></body>
</worldbody></mujoco>"""
SECOND = '<geom name="other" type="capsule" size=".04" fromto="-.2 0 -1 -.2 0 1"/>'


@pytest.mark.parametrize(
    ("limits", "second", "said"),
    [
        ('range="-3 3"', "", "post and upper touch"),
        ('limited="false"', SECOND, "rad and "),
    ],
    ids=["limited", "continuous"],
)
def test_the_planner_says_which_joint_cannot_pass(limits, second, said):
    scene = Scene.from_mjcf(ARM.format(limits=limits, second=second))
    planner = Planner(scene, PlannerConfig(max_expansions=1000))
    plan = planner.plan([-1.2, 0], [1.2, 0.5])
    assert plan.status == Status.BUDGET_EXHAUSTED
    assert (
        "no path may exist: on every way from start to goal joint 'pan'" in plan.reason
    )
    assert "none of 512 random configurations is free" in plan.reason
    assert said in plan.reason
    hurried = planner.plan([-1.2, 0], [1.2, 0.5], time_limit=60.0)
    assert hurried.status == Status.BUDGET_EXHAUSTED
    assert "no path may exist" not in hurried.reason


def test_nothing_is_said_of_a_joint_that_a_shut_room_does_not_stop():
    """Enclosed by no single joint: a search's end is all that is known."""

    def free(q):
        return jnp.linalg.norm(q, axis=1) < 1

    space = Space.of([-2, -2], [2, 2])
    assert barrier_between(free, np.zeros(2), np.array([[0.5, 0.5]]), space) is None


def test_distances_of_a_reason_are_those_of_the_limits_given():
    """A continuous joint with limits is a line: to the goal it is the long way."""
    scene = Scene.from_mjcf(ARM.format(limits='limited="false"', second=""))
    planner = Planner(
        scene, PlannerConfig(max_expansions=20), q_min=[-4, -2], q_max=[4, 2]
    )
    plan = planner.plan([-3.0, 0], [3.0, 0])
    assert plan.status == Status.BUDGET_EXHAUSTED
    gap = float(np.linalg.norm(plan.path[-1] - [3.0, 0]))
    assert gap > 1
    assert f"{gap:.3f} rad from the goal" in plan.reason
