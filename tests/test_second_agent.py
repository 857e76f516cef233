"""A second agent: it follows the task's keyframes in straight lines, without any planner."""

import numpy as np

from jaxplan.base import Action
from jaxplan.episodes import EpisodeConfig, run_episodes


class Straight:
    """To the next keyframe, a second each; knows no obstacle."""

    def __init__(self, task):
        self.task = task

    def reset(self, seeds):
        self.left = [[] for _ in range(self.task.batch)]

    def act(self, number, lanes, observation):
        task, s = self.task, np.linspace(0, 1, 150)[:, None]
        q = [observation.q[:0] for _ in self.left]
        mode = [observation.gripper[:0] for _ in self.left]
        q_toggle = observation.q.copy()
        done = np.zeros(task.batch, bool)
        for e in lanes:
            now, gripper = observation.q[e], observation.gripper[e]
            mode[e] = np.full(len(s), gripper)
            done[e] = task.in_terminal_region(e)
            if done[e]:
                q_toggle[e] = task.retreat(e)
            else:
                if not self.left[e]:
                    self.left[e] = list(task.keyframes(e, now).q)
                q_toggle[e] = self.left[e].pop(0)
                mode[e][-1] = gripper if self.left[e] else 1 - gripper
            q[e] = now + (10 * s**3 - 15 * s**4 + 6 * s**5) * (q_toggle[e] - now)
        notes = {e: {"number": number} for e in lanes}
        return Action(q, mode, q_toggle, 0.1, 0.15, done, notes)

    def obstacle(self, lane):
        return "it does not look"


def test_it_does_what_the_expert_does_without_a_planner(mug_task):
    """In the plain scene nearly every way is straight: most mugs end in the box."""
    heard = []
    records = run_episodes(
        mug_task, Straight(mug_task), range(4), listeners=[heard.append]
    )
    assert sum(record.success for record in records) >= 3
    assert [phase["number"] for phase in records[0].phases] == list(
        range(len(records[0].phases))
    )
    assert heard[0].lanes == [0, 1, 2, 3]
    late = run_episodes(mug_task, Straight(mug_task), [0], EpisodeConfig(max_phases=2))
    assert late[0].failure == "not finished after 2 phases"
