"""The numbers of a model that planning reads."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from jaxplan.scene.names import names_of


class Numbers(NamedTuple):
    """The arrays of an `MjModel` that planning reads, under MuJoCo's names and shapes."""

    body_pos: jax.Array
    body_quat: jax.Array
    geom_pos: jax.Array
    geom_quat: jax.Array
    geom_size: jax.Array
    jnt_pos: jax.Array
    jnt_axis: jax.Array
    jnt_range: jax.Array
    qpos0: jax.Array


def read_numbers(model: mujoco.MjModel) -> Numbers:
    """The model's numbers; quaternions of zeros are none.

    Raises:
        ValueError: The quaternion of a geom or of a body that hangs on another is zero.
            MuJoCo flattens such a geom to a point, and such a body does not turn with its
            parent.
    """
    bodies = names_of(model, "body")
    for body in np.flatnonzero(model.body_parentid):
        _refuse_zero(model.body_quat[body], "body", bodies[body])
    for geom, quat in enumerate(model.geom_quat):
        _refuse_zero(quat, "geom", model.geom(geom).name or f"geom{geom}")
    qpos0 = model.qpos0.copy()
    for start in model.jnt_qposadr[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]:
        qpos0[start + 3 : start + 7] = rotations(qpos0[start + 3 : start + 7])
    fields = {name: getattr(model, name) for name in Numbers._fields}
    fields |= {"body_quat": rotations(model.body_quat), "qpos0": qpos0}
    return Numbers(**{name: jnp.asarray(field) for name, field in fields.items()})


def rotations(quats: np.ndarray) -> np.ndarray:
    """Quaternions `[..., 4]`; what is zero turns nothing, as in MuJoCo."""
    zero = (quats == 0).all(-1, keepdims=True)
    return np.where(zero, (1.0, 0.0, 0.0, 0.0), quats)


def _refuse_zero(quat: np.ndarray, kind: str, name: str) -> None:
    if not quat.any():
        raise ValueError(f"{kind} {name!r} has quat [0, 0, 0, 0], which is no rotation")
