"""A data set's card: what is randomised, counts, the expert's success by pose, size.

`collect_demos.py` writes `CARD.md` and `card.json` beside the shards; everything in them is read
back from the shards and their manifest.
"""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from jaxplan import data
from jaxplan.data import TOGGLES, Shard, read_manifest, write_atomic
from jaxplan.tasks.mug.poses import RANGE, sample_pose

BINS = 3
"""Along each coordinate of the pose."""
PITCH = round(float(np.degrees(RANGE.pitch)), 1)
ROLL = round(float(np.degrees(RANGE.roll)), 1)


def write_card(directory: Path) -> None:
    """Writes `CARD.md` and `card.json` for a finished collection."""
    manifest = read_manifest(directory)
    shards = [directory / name for name in manifest["shards"]]
    card = describe(data.read_demonstrations(directory), manifest["settings"])
    card["shards"] = len(shards)
    card["megabytes"] = round(sum(path.stat().st_size for path in shards) / 1e6, 1)
    text = json.dumps(card, indent=2, sort_keys=True) + "\n"
    write_atomic(directory / "card.json", text.encode())
    write_atomic(directory / "CARD.md", as_markdown(card).encode())


def describe(shard: Shard, settings: dict[str, Any]) -> dict[str, Any]:
    """What the shards of a collection hold, JSON-ready."""
    success = shard.episode_success
    failures = Counter(str(f) for f in shard.episode_failure[~success])
    noisy = settings["demonstration"]["noisy_episodes"]
    return {
        "settings": settings,
        "randomised": {
            "x [m]": list(RANGE.x),
            "y [m]": list(RANGE.y),
            "direction of the opening [deg]": np.degrees(RANGE.yaw).round(1).tolist(),
            "side of the handle": ["left", "right"],
            "handle off its resting place [deg]": [0.0, ROLL],
            "pitch [deg]": [-PITCH, PITCH],
            "share of episodes driven beside their labels": noisy,
        },
        "episodes": len(success),
        "succeeded": int(success.sum()),
        "failures": dict(failures.most_common()),
        "success_by_pose": success_by_pose(shard.episode_seed, success),
        "frames": len(shard.q),
        "frames_by_toggle": {
            name: int((shard.toggle == i).sum()) for i, name in enumerate(TOGGLES)
        },
        "paths": len(shard.path_q),
        "path_length_median [rad]": float(np.median(shard.path_length)),
    }


def success_by_pose(
    seeds: np.ndarray, success: np.ndarray
) -> dict[str, dict[str, str]]:
    """`succeeded/episodes` in equal parts of each coordinate from which the mug is dropped."""
    poses = [sample_pose(int(seed)) for seed in seeds]
    position = np.array([p for p, _ in poses])
    axis = np.array([r[:, 2] for _, r in poses])
    handle = np.array([r[:, 0] for _, r in poses])
    yaw = np.degrees(np.arctan2(axis[:, 1], axis[:, 0]))
    left = np.einsum("ij,ij->i", np.cross([0.0, 0.0, 1.0], axis), handle) > 0
    columns = {
        "x [m]": (position[:, 0], RANGE.x),
        "y [m]": (position[:, 1], RANGE.y),
        "direction of the opening [deg]": (yaw, tuple(np.degrees(RANGE.yaw))),
    }
    rows: dict[str, dict[str, str]] = {}
    for name, (value, (low, high)) in columns.items():
        edges = np.linspace(low, high, BINS + 1)
        part = np.clip(np.digitize(value, edges) - 1, 0, BINS - 1)
        rows[name] = {
            f"{edges[k]:.4g} to {edges[k + 1]:.4g}": _share(success[part == k])
            for k in range(BINS)
        }
    rows["side of the handle"] = {
        "left": _share(success[left]),
        "right": _share(success[~left]),
    }
    return rows


def as_markdown(card: dict[str, Any]) -> str:
    """The card for people."""
    settings = card["settings"]
    lines = [
        f"# Demonstrations of the task `{settings['task']}`",
        "",
        f"{card['episodes']} episodes from seed {settings['first_seed']}, of which the expert "
        f"solved {card['succeeded']}; {card['frames']} frames from the camera "
        f"`{settings['camera']}` on {card['paths']} paths; {card['shards']} shards, "
        f"{card['megabytes']} MB.",
        "",
        *_table("Randomised", "value", card["randomised"]),
        *_table("Frames before", "number", card["frames_by_toggle"]),
        *_table("Failure", "episodes", card["failures"]),
    ]
    for name, parts in card["success_by_pose"].items():
        lines += _table(name, "succeeded", parts)
    return "\n".join(lines)


def _share(success: np.ndarray) -> str:
    return f"{int(success.sum())}/{len(success)}"


def _table(left: str, right: str, rows: dict[str, Any]) -> list[str]:
    def cell(value: Any) -> str:
        if not isinstance(value, list):
            return str(value)
        return (" or " if isinstance(value[0], str) else " to ").join(map(str, value))

    body = [f"| {name} | {cell(value)} |" for name, value in rows.items()]
    return [f"| {left} | {right} |", "|---|---|", *body, ""] if rows else []
