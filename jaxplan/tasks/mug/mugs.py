"""Mugs drawn from episodes' seeds: some to train with, others that nobody trained on."""

import colorsys
from typing import NamedTuple

import numpy as np

from jaxplan.tasks.mug.mug import MugShape

STREAM = 4
"""Of random numbers, beside those that the episode itself takes from its seed."""
BELOW_RIM = 0.017
"""Where the handle ends [m]."""
GRIP = 0.016
"""And how far below that a hand takes it [m]."""

Spans = tuple[tuple[float, float], ...]


class MugRange(NamedTuple):
    """What is drawn, each number uniformly from some spans."""

    radius: Spans
    """[m]."""
    height: Spans
    """[m]."""
    handle_depth: Spans
    """From the cup's outside to the handle's [m]."""
    handle_length: Spans
    """From its upper end to its lower one [m]. Below 38 mm the expert lost some mugs as they were
    lifted, with pads, 17 mm high, on the bar and on both of the arms that it hangs on."""
    mass: Spans
    """[kg]. From 0.26 on it dropped some of the widest after lifting them by the handle."""
    hue: Spans
    """Of the colour, 0 to 1 around the circle from red to red."""
    saturation: Spans = ((0.35, 0.9),)
    value: Spans = ((0.3, 0.9),)


RANGES = {
    "train": MugRange(
        radius=((0.034, 0.046),),
        height=((0.080, 0.110),),
        handle_depth=((0.031, 0.039),),
        handle_length=((0.042, 0.052),),
        mass=((0.12, 0.26),),
        hue=((0.0, 0.78), (0.95, 1.0)),
    ),
    "held_out": MugRange(
        radius=((0.032, 0.034), (0.046, 0.049)),
        height=((0.076, 0.080), (0.110, 0.116)),
        handle_depth=((0.028, 0.031), (0.039, 0.042)),
        handle_length=((0.038, 0.042), (0.052, 0.056)),
        mass=((0.09, 0.12),),
        hue=((0.80, 0.93),),
    ),
}
"""Those that are `held_out` are beyond all of `train` in each number but two of the colour's."""


def described(name: str) -> dict[str, str]:
    """What one of `RANGES` draws, in words and numbers."""

    def words(spans: Spans) -> str:
        return " or ".join(f"{low:g} to {high:g}" for low, high in spans)

    units = {"mass": " [kg]", "hue": "", "saturation": "", "value": ""}
    return {
        f"the mug's {field.replace('_', ' ')}{units.get(field, ' [m]')}": words(spans)
        for field, spans in RANGES[name]._asdict().items()
    }


def mug_of(name: str, seed: int) -> MugShape:
    """The mug of an episode, from one of `RANGES`."""
    rng = np.random.default_rng([seed, STREAM])
    drawn = (_within(spans, rng.random()) for spans in RANGES[name])
    radius, height, depth, length, mass, *colour = drawn
    high = height - BELOW_RIM
    return MugShape(
        radius=radius,
        height=height,
        mass=mass,
        handle_reach=radius + depth,
        handle_low=high - length,
        handle_high=high,
        grip_height=high - GRIP,
        colour=colorsys.hsv_to_rgb(*colour),
    )


def _within(spans: Spans, share: float) -> float:
    """That far through the spans, one after the other."""
    at = share * sum(high - low for low, high in spans)
    for low, high in spans:
        if at <= high - low:
            return low + at
        at -= high - low
    return spans[-1][1]
