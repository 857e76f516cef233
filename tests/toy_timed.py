"""Whole episodes small enough to learn from in a test."""

import numpy as np

from jaxplan import data

JOINTS = 7


def timed(episodes: int = 3, frames: int = 10) -> data.TimedShard:
    """Arms that go straight; the gripper closes in the middle."""
    rng = np.random.default_rng(0)
    count = episodes * frames
    at = np.tile(np.arange(frames), episodes)
    speed = np.repeat(rng.uniform(-0.05, 0.05, (episodes, JOINTS)), frames, 0)
    closes = frames // 2
    return data.as_timed_shard(
        JOINTS,
        image=rng.integers(0, 256, (count, *data.IMAGE_SHAPE)),
        q=at[:, None] * speed,
        gripper=at > closes,
        action_q=(at[:, None] + 1) * speed,
        action_gripper=at >= closes,
        toggle=at > closes,
        seed=np.repeat(np.arange(episodes), frames),
        camera_error=0.01 * rng.normal(size=(count, 5)),
        episode_seed=np.arange(episodes),
        episode_success=np.ones(episodes, bool),
        episode_failure=[""] * episodes,
    )
