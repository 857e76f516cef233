"""A trained network ready to use, and what it says it was trained for."""

from typing import Any, NamedTuple

import numpy as np


class WeightsError(ValueError):
    """Weights are missing, damaged, or do not belong together."""


class NoWeights(WeightsError):
    """A directory has none of a network."""


class Weights(NamedTuple):
    """A network ready to use."""

    config: Any
    """Of the network's class of settings."""
    params: dict
    info: dict
    """The manifest's entry."""

    def check_fits(self, task: str, camera: str, robot: str) -> None:
        """Refuses weights whose demonstrations are of other tasks, cameras or robots only.

        Raises:
            WeightsError: Naming both.
        """
        for known, asked, noun in (
            ("tasks", task, ""),
            ("cameras", camera, "camera "),
            ("robots", robot, "robot "),
        ):
            trained = self.info.get(known) or [asked]
            if asked not in trained:
                raise WeightsError(
                    f"{self.info.get('file')} was trained for {noun}{', '.join(trained)}, "
                    f"not {asked}"
                )


def merged(
    fresh: dict[str, Any], known: dict[str, Any], at: tuple[str, ...] = ()
) -> dict[str, Any]:
    """`fresh` with the arrays of `known` in place of its own; a network may have more.

    Raises:
        KeyError: `known` has an array that `fresh` has not, or has in another shape.
    """
    if not isinstance(known, dict):
        if isinstance(fresh, dict) or np.shape(fresh) != known.shape:
            raise KeyError(at)
        return known
    if not isinstance(fresh, dict) or not known.keys() <= fresh.keys():
        raise KeyError(at)
    more = {name: merged(fresh[name], known[name], (*at, name)) for name in known}
    return {**fresh, **more}
