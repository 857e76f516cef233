"""How far apart each pair of geoms must be, on the model's and on the user's account.

MuJoCo counts a contact from the sum of both geoms' margins on, from the margin of an explicit
pair where there is one; gaps only widen what it looks at. So is it here. And a pair that
is always near, such as two links around a joint, keeps no margin that it cannot keep.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from jaxplan.scene import Scene, geom_pairs


class Rule(NamedTuple):
    """What a pair of geoms asks for."""

    own: float = 0.0
    """The model's margin [m]."""
    near: float = np.inf
    """The pair is hardly ever farther apart: from such a margin on it counts as 0 [m]."""


PLAIN = Rule()


def pair_rules(scene: Scene) -> dict[tuple[int, int], Rule]:
    """Those of all pairs that are checked, by geom ids, as `geom_pairs` orders them."""
    model, margin = scene.mj_model, scene.mj_model.geom_margin
    override = bool(model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE)
    listed = zip(model.pair_geom1, model.pair_geom2, model.pair_margin, strict=True)
    explicit = {frozenset((int(i), int(j))): own for i, j, own in listed}
    near = {frozenset(pair): far for pair, far in scene.structure.near.items()}

    def rule(i: int, j: int) -> Rule:
        pair = frozenset((i, j))
        own = explicit[pair] if pair in explicit else margin[i] + margin[j]
        own = model.opt.o_margin if override else own
        return Rule(max(float(own), 0.0), near.get(pair, np.inf))

    return {
        (i, j): rule(i, j)
        for group in scene.groups
        for contact in group.contacts
        for i, j in geom_pairs(contact)
    }


def required(rules: Sequence[Rule], margin: jax.typing.ArrayLike) -> jax.Array:
    """`[n, 1]` the distances above which pairs are free, for a user's margin [m].

    The margin itself where all of the pairs are plain.
    """
    margin = jnp.asarray(margin)
    if all(rule == PLAIN for rule in rules):
        return margin
    own, near = (
        jnp.asarray(x, margin.dtype)[:, None] for x in zip(*rules, strict=True)
    )
    kept = jnp.maximum(margin, own)
    return jnp.where(kept >= near, 0, kept)


def required_clearances(scene: Scene, margin: jax.typing.ArrayLike = 0.0) -> jax.Array:
    """The distance above which `config_free` takes each pair for free.

    Args:
        scene: The scene.
        margin: The user's [m].

    Returns:
        `[ngeom, ngeom]` [m], symmetric, by geom id; 0 of pairs that are not checked.
    """
    rules, table = pair_rules(scene), jnp.zeros(2 * (scene.mj_model.ngeom,))
    if not rules:
        return table
    kept = jnp.ravel(required([*rules.values()], margin))
    i, j = np.array([*rules]).T
    return table.at[i, j].set(kept).at[j, i].set(kept)
