"""Demonstrations small enough to learn from in a test."""

import numpy as np

from jaxplan import data


def demonstrations(episodes: int = 8, frames: int = 4) -> data.Shard:
    """A square whose place on the image says where q_toggle is; one path an episode."""
    rng = np.random.default_rng(0)
    count = episodes * frames
    at = rng.uniform(-1, 1, (episodes, 2))
    image = np.full((count, *data.IMAGE_SHAPE), 90, np.uint8)
    for row in range(count):
        x, y = (at[row // frames] * (50, 30) + (68, 44)).astype(int)
        image[row, y - 6 : y + 6, x - 6 : x + 6] = (220, 40, 40)
    share = np.linspace(0, 1, data.PATH_POINTS)[:, None]
    q_start = np.array([0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.5])
    q_goal = q_start + 0.4 * np.repeat(at, [4, 3], axis=1)
    path_q = q_start + share * (q_goal - q_start)[:, None]
    length = np.linalg.norm(q_goal - q_start, axis=1)
    episode = np.repeat(np.arange(episodes), frames)
    part = np.tile(np.linspace(0, 0.8, frames), episodes)[:, None]
    return data.as_shard(
        image=image,
        q=q_start + part * (q_goal - q_start)[episode],
        gripper=np.zeros(count),
        q_toggle=q_goal[episode],
        gripper_toggle=np.ones(count),
        q_goal=q_goal[episode],
        toggle=np.zeros(count),
        seed=episode,
        camera_error=0.01 * rng.normal(size=(count, 5)),
        path=np.where(np.arange(count) % frames == frames - 1, data.NO_PATH, episode),
        arc=part[:, 0] * length[episode],
        path_q=path_q,
        path_length=length,
        episode_seed=np.arange(episodes),
        episode_success=np.ones(episodes, bool),
        episode_failure=[""] * episodes,
    )
