"""What tells one scene from another: names, and a checksum of its numbers."""

import hashlib
from collections import Counter
from typing import Any

import numpy as np

from jaxplan.scene.scene import Scene

DIGITS = 5
"""Numbers are compared up to so many decimals: machines differ in the last bits."""


def identity(scene: Scene) -> dict[str, Any]:
    """JSON-ready: equal for two scenes exactly if they are the same to a planner."""
    model = scene.mj_model
    digest = hashlib.sha256()
    for name, numbers in scene.model._asdict().items():
        whole = np.round(np.asarray(numbers, np.float64), DIGITS) + 0.0  # no -0
        digest.update(f"{name}{whole.shape}".encode() + whole.tobytes())
    for name in ("geom_type", "geom_bodyid", "jnt_bodyid", "body_parentid"):
        digest.update(np.asarray(getattr(model, name), np.int64).tobytes())
    vertices = np.round(np.asarray(model.mesh_vert, np.float64), DIGITS) + 0.0
    digest.update(vertices.tobytes())
    digest.update("\n".join("|".join(pair) for pair in scene.pairs).encode())
    return {
        "joints": list(scene.joints),
        "objects": list(scene.objects),
        "slots": dict(Counter(slot.kind for slot in scene.slots)),
        "sha256": digest.hexdigest(),
    }


def difference(found: dict[str, Any], wanted: dict[str, Any]) -> str | None:
    """What tells two identities apart, in words; None where nothing does."""
    for name in ("joints", "objects", "slots"):
        if found[name] != wanted[name]:
            return f"{name} {found[name]}, not {wanted[name]}"
    if found["sha256"] != wanted["sha256"]:
        return "other poses, sizes, limits or contacts"
    return None
