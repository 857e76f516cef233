"""Weights of a scene's sampler, as the planner takes them."""

import os
from typing import Any

from jaxplan.learning.weights import NoWeights
from jaxplan.pretrained.store import load_weights, networks_in
from jaxplan.samplers import FAMILIES, SceneSampler

QUICKEST = "few_step"
"""Taken where a directory has several."""


def load_sampler(
    directory: str | os.PathLike, name: str | None = None, **changes: Any
) -> SceneSampler:
    """Trained segments for a scene: `Planner(scene, sampler=load_sampler(directory))`.

    Args:
        directory: Where `python -m jaxplan.train scene_...` wrote its weights.
        name: `sampler` (diffusion), `few_step`, `cvae` or `gan`; None: `few_step` if it is
            there, or the first that is.
        **changes: To the sampler's config, such as `num_inference_steps`.

    Raises:
        WeightsError: There is none, it is damaged, or it sees pictures and no scene.
        ValueError: The sampler has no such setting.
    """
    if name is None:
        there = [known for known in FAMILIES if known in networks_in(directory)]
        if not there:
            raise NoWeights(f"no sampler in {os.fspath(directory)}")
        name = QUICKEST if QUICKEST in there else there[0]
    return SceneSampler(load_weights(name, directory), **changes)
