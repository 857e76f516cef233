"""A data set's card: what is randomised, counts, the expert's success by start, size.

`collect_demos.py` writes `CARD.md` and `card.json` beside the shards; everything in them is read
back from the shards and their manifest.
"""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from jaxplan import data, tasks
from jaxplan.data import (
    TOGGLES,
    Demonstrations,
    Shard,
    TimedShard,
    read_manifest,
    write_atomic,
)
from jaxplan.tasks import ONE, TASKS
from jaxplan.tasks.starts import Starts

BINS = 3
"""Along each coordinate of the pose."""


def write_card(directory: Path) -> None:
    """Writes `CARD.md` and `card.json` for a finished collection."""
    manifest = read_manifest(directory)
    shards = [directory / name for name in manifest["shards"]]
    kind = Shard if "frame_period" not in manifest["settings"] else TimedShard
    card = describe(data.read_demonstrations(directory, kind), manifest["settings"])
    card["shards"] = len(shards)
    card["megabytes"] = round(sum(path.stat().st_size for path in shards) / 1e6, 1)
    text = json.dumps(card, indent=2, sort_keys=True) + "\n"
    write_atomic(directory / "card.json", text.encode())
    write_atomic(directory / "CARD.md", as_markdown(card).encode())


def describe(shard: Demonstrations, settings: dict[str, Any]) -> dict[str, Any]:
    """What the shards of a collection hold, JSON-ready."""
    success = shard.episode_success
    failures = Counter(str(f) for f in shard.episode_failure[~success])
    entry = TASKS[settings["task"].split("_")[0]]
    starts = entry.starts
    randomised = starts.described() if starts else {}
    randomised |= entry.objects[settings.get("objects", ONE)]
    noisy = settings["demonstration"]["noisy_episodes"]
    randomised["share of episodes driven beside their labels"] = noisy
    return {
        "settings": settings,
        "randomised": randomised,
        "episodes": len(success),
        "succeeded": int(success.sum()),
        "failures": dict(failures.most_common()),
        "success_by_start": success_by_start(starts, shard.episode_seed, success),
        "frames": len(shard.q),
        "frames_by_toggle": {
            name: int((shard.toggle == i).sum()) for i, name in enumerate(TOGGLES)
        },
        **(_paths(shard, settings) if isinstance(shard, Shard) else _pace(shard)),
    }


def _paths(shard: Shard, settings: dict[str, Any]) -> dict[str, Any]:
    return {
        "paths": len(shard.path_q),
        "path_length_median [rad]": float(np.median(shard.path_length)),
        "ways": ways_taken(shard, settings),
    }


def ways_taken(shard: Shard, settings: dict[str, Any]) -> dict[str, int]:
    """Episodes by the way that their last motions took, where the scene has several."""
    name, _, variant = settings["task"].partition("_")
    task = tasks.load(name, 1, variant or "plain", settings["camera"])
    if not task.zones:
        return {}
    there = (shard.toggle == len(TOGGLES) - 1) & (shard.path != data.NO_PATH)
    taken = {
        (seed, task.way(shard.path_q[path]))
        for seed, path in zip(shard.seed[there], shard.path[there], strict=True)
    }
    return dict(sorted(Counter(way for _, way in taken if way).items()))


def _pace(shard: TimedShard) -> dict[str, float]:
    lengths = np.unique(shard.seed, return_counts=True)[1]
    toggling = shard.gripper != shard.action_gripper
    return {
        "frames an episode, median": float(np.median(lengths)),
        "frames that toggle": int(toggling.sum()),
    }


def success_by_start(
    starts: Starts | None, seeds: np.ndarray, success: np.ndarray
) -> dict[str, dict[str, str]]:
    """`succeeded/episodes` in equal parts of each coordinate that is drawn, and of each choice."""
    if starts is None:
        return {}
    drawn = [starts.of(int(seed)) for seed in seeds]
    rows: dict[str, dict[str, str]] = {}
    for name, (low, high) in starts.ranges.items():
        edges = np.linspace(low, high, BINS + 1)
        value = np.array([start[name] for start in drawn])
        part = np.clip(np.digitize(value, edges) - 1, 0, BINS - 1)
        rows[name] = {
            f"{edges[k]:.4g} to {edges[k + 1]:.4g}": _share(success[part == k])
            for k in range(BINS)
        }
    for name, words in starts.choices.items():
        chosen = np.array([start[name] for start in drawn])
        rows[name] = {word: _share(success[chosen == word]) for word in words}
    return rows


def as_markdown(card: dict[str, Any]) -> str:
    """The card for people."""
    settings = card["settings"]
    lines = [
        f"# Demonstrations of the task `{settings['task']}`",
        "",
        f"{card['episodes']} episodes from seed {settings['first_seed']}, of which the expert "
        f"solved {card['succeeded']}; {card['frames']} frames from the camera "
        f"`{settings['camera']}`{_what(card)}; {card['shards']} shards, "
        f"{card['megabytes']} MB.",
        "",
        *_table("Randomised", "value", card["randomised"]),
        *_table("Frames before", "number", card["frames_by_toggle"]),
        *_table("Failure", "episodes", card["failures"]),
        *_table("Way", "episodes", card.get("ways", {})),
    ]
    for name, parts in card["success_by_start"].items():
        lines += _table(name, "succeeded", parts)
    return "\n".join(lines)


def _what(card: dict[str, Any]) -> str:
    if "paths" in card:
        return f" on {card['paths']} paths"
    each = card["frames an episode, median"]
    period = card["settings"]["frame_period"]
    return f", one each {period} s ({each:.0f} an episode), with the expert's actions"


def _share(success: np.ndarray) -> str:
    return f"{int(success.sum())}/{len(success)}"


def _table(left: str, right: str, rows: dict[str, Any]) -> list[str]:
    def cell(value: Any) -> str:
        if not isinstance(value, list):
            return str(value)
        return (" or " if isinstance(value[0], str) else " to ").join(map(str, value))

    body = [f"| {name} | {cell(value)} |" for name, value in rows.items()]
    return [f"| {left} | {right} |", "|---|---|", *body, ""] if rows else []
