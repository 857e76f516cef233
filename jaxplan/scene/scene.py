"""A MuJoCo model as planning sees it: what the arm moves, what it can hold, what can touch.

Numbers (poses and sizes of geoms, joint axes, limits) are arrays, a pytree: replace one
and every query answers for the new scene without recompiling. Structure (which bodies,
joints and pairs there are) is static and read once.

Obstacles that come and go between queries live in slots: geoms of a body `obstacles` whose
poses and sizes are in the `World`. Objects whose shape differs from query to query are
`shaped`: where their geoms are on them, and how large, is in the `World` too.
"""

import copy
import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from os import PathLike
from typing import Any

import jax
import mujoco
import numpy as np

from jaxplan.process import refuse_fork
from jaxplan.scene.chain import line
from jaxplan.scene.excludes import ALWAYS, Exclude, Excluded
from jaxplan.scene.groups import mask_of, pairs_of, table_of
from jaxplan.scene.limits import arm_limits, circular, rates
from jaxplan.scene.names import geom_name, known, shortened
from jaxplan.scene.numbers import Numbers, read_numbers
from jaxplan.scene.source import SLOTS, check_arguments, compile_model
from jaxplan.scene.srdf import read_srdf
from jaxplan.scene.structure import Group, Slot, Structure, read_again, read_structure
from jaxplan.scene.urdf import read_urdf


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["model"],
    meta_fields=["structure"],
)
@dataclasses.dataclass(frozen=True, eq=False, repr=False)
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
        exclude: Exclude = ALWAYS,
        shaped: Sequence[str] = (),
    ) -> "Scene":
        """Reads a scene.

        Args:
            source: An MJCF's path or text, a URDF's path, an `MjSpec` or an `MjModel`.
            joints: The arm's joints in the order of q. None: all hinge and slide joints
                that are not the gripper's, on the longest way down from the world. It
                ends where the tree branches into parts with no more joints than stand
                above (fingers), and before joints at the very end that are called
                gripper, finger or jaw; it begins after those that drive a base over the
                floor. Joints that follow others by an <equality><joint> are none of the
                arm's, unless those can follow them.
            hand: The body that carries what is held. None: the last body before another
                joint or a branch follows, from that of the last of `joints` on.
            slots: Room for obstacles that change between queries: how many of each kind
                (sphere, capsule, cylinder, ellipsoid, box), such as `{"box": 16}`. They
                can touch whatever can touch anything.
            exclude: Contacts to leave out, besides the model's own: "always_touching", for
                geoms that overlap wherever the arm is (neighbouring links, often; never
                objects and slots); pairs of bodies, ("hand", "cup") or "hand|cup"; a list
                of both; or None. `excluded` says which.
            shaped: Objects whose shape differs from query to query: `World.geom_pos` and
                `World.geom_size` give the places and sizes of their geoms, of which there
                are always the same, turned the same way.

        Raises:
            FileNotFoundError: There is no such file.
            ValueError: The file is no valid model, or a number in it is not finite; a
                joint or body is not in it, or cannot be planned for; `joints` is None
                and several chains are longest; a geom that can touch the arm is a height
                field, a flex or an SDF; the arm's joints are tied by a loop or a tendon,
                or leave no values to joints that follow them; what is shaped is no object,
                or has a mesh that can touch something.
        """
        refuse_fork()
        check_arguments(source, joints, hand, slots)
        model = compile_model(source, slots or {})
        names = SLOTS if slots and any(slots.values()) else None
        structure = read_structure(model, joints, hand, names, exclude, shaped)
        numbers = read_numbers(model)
        arm_limits(structure, numbers)  # raises where a joint has no room
        return cls(numbers, structure)

    @classmethod
    def from_urdf(
        cls,
        path: str | PathLike,
        srdf: str | PathLike | None = None,
        joints: str | Sequence[str] | None = None,
        hand: str | None = None,
        slots: Mapping[str, int] | None = None,
        exclude: Exclude = ALWAYS,
        meshes: str | PathLike | None = None,
    ) -> "Scene":
        """Reads a robot as ROS has it: its collision shapes, with its root link fixed.

        Args:
            path: Of the URDF.
            srdf: Of the SRDF: links whose collisions it disables are left out.
            joints: As for `from_mjcf`, or the name of a group in the SRDF.
            hand: See `from_mjcf`.
            slots: See `from_mjcf`.
            exclude: See `from_mjcf`.
            meshes: Folder of packages or meshes; None: the URDF's own, and all above it.

        Raises:
            FileNotFoundError: There is no such file, or a mesh that is not found.
            ValueError: As for `from_mjcf`; no such group; a mesh that MuJoCo cannot read.
        """
        spec = read_urdf(path, meshes)
        disabled, groups = ((), {}) if srdf is None else read_srdf(srdf, spec)
        if isinstance(joints, str):
            joints = groups[known(joints, "group", list(groups))]
        given = [exclude] if isinstance(exclude, str) else exclude or ()
        return cls.from_mjcf(spec, joints, hand, slots, [*given, *disabled])

    def replace(self, **fields: jax.Array) -> "Scene":
        """The scene with some of its `Numbers` replaced, e.g. `geom_pos`.

        No recompilation follows, except from `geom_quat`: which boxes are parallel is
        structure, so that field must be concrete and gives a new structure. So it is with
        `jnt_range` and `qpos0` where joints follow others, for how fast they do.
        """
        structure = self.structure
        follows = ("jnt_range", "qpos0") if structure.dependent else ()
        if changed := fields.keys() & {"geom_quat", *follows}:
            model = copy.copy(self.mj_model)
            for name in changed:
                getattr(model, name)[:] = fields[name]
            structure = read_again(structure, model)
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
    def dependent(self) -> tuple[str, ...]:
        """Joints that follow the arm's or passive ones by an <equality><joint>."""
        names = self.structure.joint_names
        return tuple(names[follows.joint] for follows in self.structure.dependent)

    @property
    def objects(self) -> tuple[str, ...]:
        """Bodies with a free joint, then mocap bodies: `World.object_pose` places them."""
        return self.structure.objects

    @property
    def mocap(self) -> tuple[str, ...]:
        """Mocap bodies, the last of the objects: they can be placed but not held."""
        return self.structure.mocap

    @property
    def bases(self) -> tuple[str, ...]:
        """Objects on which the arm hangs: they stand where they are placed, never held."""
        return self.structure.bases

    @property
    def slots(self) -> tuple[Slot, ...]:
        """Room for obstacles: `World.slot_pose` and `World.slot_size` fill it."""
        return self.structure.slots

    @property
    def shaped(self) -> tuple[int, ...]:
        """Geoms whose places and sizes `World.geom_pos` and `World.geom_size` give, by id."""
        return self.structure.shaped

    @property
    def hand(self) -> str:
        """The body in whose frame a held object's pose is given."""
        return self.structure.hand

    @property
    def groups(self) -> tuple[Group, ...]:
        """Contacts by pair of bodies, after MuJoCo's filter."""
        return self.structure.groups

    @property
    def excluded(self) -> tuple[Excluded, ...]:
        """Contacts that are left out besides the model's own, and why."""
        return self.structure.excludes.rows

    @property
    def q_min(self) -> jax.Array:
        """`[d]` lower joint limits [rad or m]; -inf where a joint has none.

        Within them, all joints that follow the arm's are inside their own limits.
        """
        return arm_limits(self.structure, self.model)[0]

    @property
    def q_max(self) -> jax.Array:
        """`[d]` upper joint limits [rad or m]; inf where a joint has none."""
        return arm_limits(self.structure, self.model)[1]

    @property
    def circular(self) -> np.ndarray:
        """`[d]` bool: joints that come back to where they were after a full turn.

        These are hinges without limits, their own or those of joints that follow them,
        provided that what follows them comes back too. If it does not (a gear of 2 : 5, a
        spindle), each value of the joint is another configuration, on a line without ends.
        """
        return circular(self.structure)

    @property
    def rates(self) -> np.ndarray:
        """`[n, d]` how far each joint moves at most while one of the arm's moves by 1.

        Of all hinges and slides (`Structure.variables`), within the limits.
        """
        return rates(self.structure)

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

    def line(self, body: int) -> list[int]:
        """Ids of the body, its parent and so on, without the world."""
        return line(self.mj_model, body)

    def joint_kind(self, name: str) -> str:
        """hinge or slide."""
        kind = self.mj_model.jnt_type[self.joint_id(name)]
        return "slide" if kind == mujoco.mjtJoint.mjJNT_SLIDE else "hinge"

    def ignored(self, names: Iterable[str | tuple[str, str]]) -> np.ndarray:
        """`[n_groups]` mask of contact groups, for `World.ignored`.

        Args:
            names: Pairs of bodies, "hand|cup" or ("hand", "cup") in either order; geoms
                that hang on no body of their own belong to "world". Pairs that are not
                checked anyway may be named.

        Raises:
            ValueError: There is no such body.
        """
        return mask_of(self.groups, self.structure.body_names, names)

    @property
    def pairs(self) -> list[tuple[str, str, str]]:
        """(group, geom, geom) of every pair that is checked, by name."""
        return pairs_of(self.groups, self.geom_name)

    def group_table(self) -> np.ndarray:
        """`[ngeom, ngeom]` contact group of each pair of geoms, -1 = none."""
        return table_of(self.groups, self.mj_model.ngeom)

    def geom_name(self, geom: int) -> str:
        """A geom's name; body[number] where it has none."""
        return geom_name(self.mj_model, self.structure.body_names, geom)

    def __repr__(self) -> str:
        return (
            f"Scene(joints: {shortened(self.joints)}; objects: {shortened(self.objects)}; "
            f"{len(self.pairs)} pairs; {len(self.slots)} slots)"
        )
