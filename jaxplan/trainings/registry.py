"""What `python -m jaxplan.train` can train."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from jaxplan.learning.predictor import PredictorTraining
from jaxplan.policies import POLICIES
from jaxplan.pretrained import UPPER
from jaxplan.samplers import FAMILIES
from jaxplan.trainings import scene_sampler
from jaxplan.trainings.policy import train_policy
from jaxplan.trainings.predictor import train_predictor
from jaxplan.trainings.sampler import train_sampler
from jaxplan.trainings.scene_sampler import train_scene_sampler


class Training(NamedTuple):
    """One kind."""

    settings: Any
    """By default."""
    run: Callable[[Any], Path]
    """Settings to the exported weights."""


def trainings() -> dict[str, Training]:
    """By name: the upper network, each sampler for a task and for a scene, each policy."""
    found = {UPPER: Training(PredictorTraining(), train_predictor)}
    for name, family in FAMILIES.items():
        found[name] = Training(family.training(), partial(train_sampler, family))  # pyright: ignore
    for name, family in FAMILIES.items():
        found[f"scene_{name}"] = Training(
            scene_sampler.settings(family), partial(train_scene_sampler, family)
        )
    for name, policy in POLICIES.items():
        found[name] = Training(policy.training(), partial(train_policy, policy))  # pyright: ignore
    return found
