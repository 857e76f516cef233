"""A MuJoCo model as planning sees it: what the arm moves, what it can hold, what can touch.

Numbers (poses and sizes of geoms, joint axes, limits) stay in an `mjx.Model`, a pytree:
replace one and every query answers for the new scene without recompiling. Structure
(which bodies, joints and pairs there are) is static and read once.
"""

import copy
import dataclasses
from collections.abc import Iterable, Sequence
from functools import partial
from os import PathLike

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from jaxplan.scene.contacts import geom_pairs
from jaxplan.scene.quiet_mjx import mjx
from jaxplan.scene.structure import Group, Structure, known, read_structure


@partial(
    jax.tree_util.register_dataclass,
    data_fields=["model"],
    meta_fields=["structure"],
)
@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """A pytree: the `mjx.Model` is its data, the structure is static."""

    model: mjx.Model
    structure: Structure

    @classmethod
    def from_mjcf(
        cls,
        source: str | PathLike | mujoco.MjSpec | mujoco.MjModel,
        joints: Sequence[str] | None = None,
        hand: str | None = None,
    ) -> "Scene":
        """Reads a scene.

        Args:
            source: An MJCF's path or text, an `MjSpec` or an `MjModel`.
            joints: The arm's joints in the order of q. None: from the first hinge or
                slide joint down the tree until it branches (where the fingers begin).
            hand: The body that carries what is held. None: the last body before the
                tree branches.

        Raises:
            ValueError: A joint or body is not in the model, or cannot be planned for.
        """
        if isinstance(source, mujoco.MjModel):
            model = source
        elif not isinstance(source, str | PathLike):
            model = source.compile()
        elif "<mujoco" in str(source):
            model = mujoco.MjModel.from_xml_string(str(source))
        else:
            model = mujoco.MjModel.from_xml_path(str(source))
        return cls(mjx.put_model(model), read_structure(model, joints, hand))

    def replace(self, **fields: jax.Array) -> "Scene":
        """The scene with fields of its `mjx.Model` replaced, e.g. `geom_pos`.

        No recompilation follows, except from `geom_quat`: which boxes are parallel is
        structure, so that field must be concrete and gives a new structure.
        """
        structure = self.structure
        if "geom_quat" in fields:
            turned = copy.copy(self.mj_model)
            turned.geom_quat[:] = np.asarray(fields["geom_quat"])
            structure = read_structure(turned, self.joints, self.hand)
        return Scene(self.model.replace(**fields), structure)

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
        """Bodies with a free joint: `World.object_pose` places them."""
        return self.structure.objects

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
        ids = np.array([self.mj_model.joint(name).id for name in self.joints])
        limited = self.mj_model.jnt_limited[ids] != 0
        return jnp.where(limited, self.model.jnt_range[ids, side], unlimited)

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
        return model.geom(geom).name or f"{model.body(body).name}[{number}]"
