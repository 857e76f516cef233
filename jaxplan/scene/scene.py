"""A MuJoCo model as planning sees it: what the arm moves, what it can hold, what can touch.

Numbers (poses and sizes of geoms, joint axes, limits) are arrays, a pytree: replace one
and every query answers for the new scene without recompiling. Structure (which bodies,
joints and pairs there are) is static and read once.

Obstacles that come and go between queries live in slots: geoms of a body `obstacles` whose
poses and sizes are in the `World`.
"""

import copy
import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from os import PathLike
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from jaxplan.process import refuse_fork
from jaxplan.scene.chain import line
from jaxplan.scene.contacts import geom_pairs
from jaxplan.scene.names import known
from jaxplan.scene.source import SLOTS, check_arguments, compile_model
from jaxplan.scene.structure import Group, Slot, Structure, read_structure


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


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["model"],
    meta_fields=["structure"],
)
@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """A pytree: the numbers are its data, the structure is static."""

    model: Numbers
    structure: Structure

    def __getstate__(self) -> dict[str, Any]:
        """A copy has its numbers in NumPy: so it can be read without JAX."""
        numbers = Numbers(*map(np.asarray, self.model))  # type: ignore[arg-type]
        return {"model": numbers, "structure": self.structure}

    @classmethod
    def from_mjcf(
        cls,
        source: str | PathLike | mujoco.MjSpec | mujoco.MjModel,
        joints: Sequence[str] | None = None,
        hand: str | None = None,
        slots: Mapping[str, int] | None = None,
    ) -> "Scene":
        """Reads a scene.

        Args:
            source: An MJCF's path or text, an `MjSpec` or an `MjModel`.
            joints: The arm's joints in the order of q. None: all hinge and slide joints
                that are not the gripper's, on the longest way down from the world. It
                ends where the tree branches into parts with no more joints than stand
                above (fingers), and before joints at the very end that are called
                gripper, finger or jaw.
            hand: The body that carries what is held. None: the last body before another
                joint or a branch follows, from that of the last of `joints` on.
            slots: Room for obstacles that change between queries: how many of each kind
                (sphere, capsule, cylinder, ellipsoid, box), such as `{"box": 16}`. They
                can touch whatever can touch anything.

        Raises:
            FileNotFoundError: There is no such file.
            ValueError: The file is no valid model, or a number in it is not finite; a
                joint or body is not in it, or cannot be planned for; `joints` is None
                and several chains are longest; a geom that can touch the arm is a height
                field, a flex or an SDF.
        """
        refuse_fork()
        check_arguments(source, joints, hand, slots)
        slots = slots or {}
        model = compile_model(source, slots)
        numbers = Numbers(*(jnp.asarray(getattr(model, f)) for f in Numbers._fields))
        names = SLOTS if any(slots.values()) else None
        return cls(numbers, read_structure(model, joints, hand, names))

    def replace(self, **fields: jax.Array) -> "Scene":
        """The scene with some of its `Numbers` replaced, e.g. `geom_pos`.

        No recompilation follows, except from `geom_quat`: which boxes are parallel is
        structure, so that field must be concrete and gives a new structure.
        """
        structure = self.structure
        if "geom_quat" in fields:
            turned = copy.copy(self.mj_model)
            turned.geom_quat[:] = np.asarray(fields["geom_quat"])
            slots = SLOTS if self.slots else None
            structure = read_structure(turned, self.joints, self.hand, slots)
        return Scene(self.model._replace(**fields), structure)

    @property
    def mj_model(self) -> mujoco.MjModel:
        """What the scene was read from: names, and numbers before any `replace`."""
        return self.structure.mj_model

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints of the arm, in the order of q."""
        return self.structure.joints

    @property
    def passive(self) -> tuple[str, ...]:
        """Other hinge and slide joints (the fingers): `World.passive` sets them."""
        return self.structure.passive

    @property
    def objects(self) -> tuple[str, ...]:
        """Bodies with a free joint, then mocap bodies: `World.object_pose` places them."""
        return self.structure.objects

    @property
    def mocap(self) -> tuple[str, ...]:
        """Mocap bodies, the last of the objects: they can be placed but not held."""
        return self.structure.mocap

    @property
    def slots(self) -> tuple[Slot, ...]:
        """Room for obstacles: `World.slot_pose` and `World.slot_size` fill it."""
        return self.structure.slots

    @property
    def hand(self) -> str:
        """The body in whose frame a held object's pose is given."""
        return self.structure.hand

    @property
    def groups(self) -> tuple[Group, ...]:
        """Contacts by pair of bodies, after MuJoCo's filter."""
        return self.structure.groups

    @property
    def q_min(self) -> jax.Array:
        """`[d]` lower joint limits [rad or m]; -inf where a joint has none."""
        return self._limits(0, -jnp.inf)

    @property
    def q_max(self) -> jax.Array:
        """`[d]` upper joint limits [rad or m]; inf where a joint has none."""
        return self._limits(1, jnp.inf)

    def _limits(self, side: int, unlimited: float) -> jax.Array:
        ids = np.array([self.joint_id(name) for name in self.joints])
        limited = self.mj_model.jnt_limited[ids] != 0
        return jnp.where(limited, self.model.jnt_range[ids, side], unlimited)

    def joint_id(self, name: str) -> int:
        """MuJoCo's id of a joint; joints without a name are called joint4, after theirs."""
        names = self.structure.joint_names
        return names.index(known(name, "joint", names))

    def body_id(self, name: str) -> int:
        """MuJoCo's id of a body; bodies without a name are called body3, after theirs."""
        names = self.structure.body_names
        return names.index(known(name, "body", names))

    def addresses(self, joints: Iterable[str]) -> np.ndarray:
        """`[n]` where the joints' positions (a free joint's seven) begin in qpos."""
        ids = [self.joint_id(name) for name in joints]
        return self.mj_model.jnt_qposadr[np.array(ids, int)]

    @property
    def arm_bodies(self) -> set[int]:
        """Ids of the bodies on which the arm's joints are."""
        ids = [self.joint_id(name) for name in self.joints]
        return {int(body) for body in self.mj_model.jnt_bodyid[ids]}

    def line(self, body: int) -> list[int]:
        """Ids of the body, its parent and so on, without the world."""
        return line(self.mj_model, body)

    def joint_kind(self, name: str) -> str:
        """hinge or slide."""
        kind = self.mj_model.jnt_type[self.joint_id(name)]
        return "slide" if kind == mujoco.mjtJoint.mjJNT_SLIDE else "hinge"

    def ignored(self, names: Iterable[str]) -> np.ndarray:
        """`[n_groups]` mask of contact groups, for `World.ignored`.

        Args:
            names: Pairs of bodies, "hand|mug" or "mug|hand"; geoms that hang on no
                body of their own belong to "world".

        Raises:
            ValueError: There is no such group.
        """
        every = [group.name for group in self.groups]
        mask = np.zeros(len(every), bool)
        for name in names:
            ordered = "|".join(sorted(name.split("|")))
            mask[every.index(known(ordered, "contact group", every))] = True
        return mask

    @property
    def pairs(self) -> list[tuple[str, str, str]]:
        """(group, geom, geom) of every pair that is checked, by name."""
        return [
            (group.name, self.geom_name(i), self.geom_name(j))
            for group in self.groups
            for contact in group.contacts
            for i, j in geom_pairs(contact)
        ]

    def group_table(self) -> np.ndarray:
        """`[ngeom, ngeom]` contact group of each pair of geoms, -1 = none."""
        table = np.full((self.mj_model.ngeom, self.mj_model.ngeom), -1)
        for index, group in enumerate(self.groups):
            for contact in group.contacts:
                for i, j in geom_pairs(contact):
                    table[i, j] = table[j, i] = index
        return table

    def geom_name(self, geom: int) -> str:
        """A geom's name; body[number] where it has none."""
        model = self.mj_model
        body = model.geom_bodyid[geom]
        number = geom - model.body_geomadr[body]
        return model.geom(geom).name or f"{self.structure.body_names[body]}[{number}]"
