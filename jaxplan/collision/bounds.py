"""How far a joint motion moves geoms at most, wherever the arm is: a table, linear in it.

As in `reach`, but rho is the greatest that it can be: from a joint's axis across to the next
joint's anchor, then all the way along the arm, slides at their ends.
"""

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.engine import counting
from jaxplan.collision.kinematics import link_poses
from jaxplan.collision.programs import per_scene
from jaxplan.collision.reach import (
    Extent,
    Ways,
    coordinates,
    extents,
    find_ways,
    joint_axes,
    link_rates,
    link_slides,
    moved_by,
    norm,
)
from jaxplan.collision.shapes import cross
from jaxplan.collision.world import World
from jaxplan.scene import Scene, geom_pairs


def group_bounds(
    scene: Scene,
    world: World,
    dq: jax.Array,
    limits: tuple[jax.Array, jax.Array] | None = None,
) -> jax.Array:
    """How far the geoms of each contact group move at most, one towards the other.

    Args:
        scene: The scene.
        world: Leaves with the batch last.
        dq: `[d, B]` [rad or m].
        limits: `[d]` each, of the joints; the scene's where None.

    Returns:
        `[n_groups, B]` [m]; 0 of groups that do not count.
    """
    ways = find_ways(scene)
    travel, extent = _anywhere(scene, world, ways, limits)
    reach = 0.0
    for side in range(2):
        geoms, own = [], []
        for index, group in enumerate(scene.groups):
            body = group.contacts[0][side].body
            sides = [s for contact in group.contacts for s in contact if s.body == body]
            geoms.append(sorted({geom for side in sides for geom in side.ids}))
            own.append(ways.of_side[index, body])
        reach += moved_by(travel, own, _each(extent.of(geoms)))
    bounds = jnp.where(dq == 0, 0, jnp.abs(dq) * _known(reach)).sum(1)
    return jnp.where(counting(scene, world), bounds, 0)


def pair_reaches(scene: Scene, world: World) -> np.ndarray:
    """How far each joint, moving by 1, moves the geoms of a pair at most.

    Args:
        scene: The scene.
        world: Leaves with a last axis of 1.

    Returns:
        `[ngeom, ngeom, d]` [m per rad or m], symmetric; 0 of pairs that are not checked.
    """
    table = np.zeros(2 * (scene.mj_model.ngeom,) + (len(scene.joints),))
    pairs = np.array([pair for _, pair in _pairs(scene)], int).reshape(-1, 2)
    limits = scene.q_min, scene.q_max
    table[*pairs.T] = table[*pairs.T[::-1]] = np.asarray(_reaches(scene, world, limits))
    return table


@per_scene
def _reaches(
    scene: Scene, world: World, limits: tuple[jax.Array, jax.Array]
) -> jax.Array:
    """`[n_pairs, d]`, as `_pairs` orders them."""
    ways, pairs = find_ways(scene), _pairs(scene)
    travel, extent = _anywhere(scene, world, ways, limits)
    reach = jnp.zeros((len(pairs), len(scene.joints), 1))
    if not pairs:
        return reach[..., 0]
    groups, geoms = zip(*pairs, strict=True)
    for side in zip(*geoms, strict=True):
        own = [(geom,) for geom in side]
        sides = ways.of_geoms(scene, groups, own)
        reach += moved_by(travel, sides, _each(extent.of(own)))
    return _known(reach)[..., 0]


def _known(reach: jax.Array | float) -> jax.Array:
    """Infinite where there is no bound, also where that meets a lever of length 0."""
    return jnp.where(jnp.isnan(reach), jnp.inf, reach)


def _pairs(scene: Scene) -> list[tuple[int, tuple[int, int]]]:
    """Contact group and geoms of all pairs."""
    return [
        (index, pair)
        for index, group in enumerate(scene.groups)
        for contact in group.contacts
        for pair in geom_pairs(contact)
    ]


def _each(extent: Extent) -> Extent:
    """With an axis for the joints."""
    return Extent(*(leaf[:, None] for leaf in extent))


def _anywhere(
    scene: Scene,
    world: World,
    ways: Ways,
    limits: tuple[jax.Array, jax.Array] | None,
) -> tuple[jax.Array, Extent]:
    """What `travel_from` is at most, for each joint moving by 1: `[n_ways, 3, d, B]`."""
    low, high = (scene.q_min, scene.q_max) if limits is None else limits
    reference = jnp.asarray(scene.model.qpos0)[scene.addresses(scene.joints)]
    middle = jnp.where(jnp.isfinite(low + high), (low + high) / 2, reference)
    width = max(leaf.shape[-1] for leaf in world)
    amid = jnp.broadcast_to(middle[:, None], (len(middle), width))
    poses = link_poses(scene, world, amid)
    anchor, axis = joint_axes(scene, poses)
    rates, slides, order = link_rates(scene), link_slides(scene)[:, None], ways.order()
    stroke = jnp.where(rates > 0, rates * (high - low) / 2, 0).sum(1, keepdims=True)
    stroke = jnp.where(slides, stroke, 0)

    twist, path, turn = jnp.zeros((3, len(order), rates.shape[1], 1), poses.dtype)
    length = jnp.zeros((len(order), 1), poses.dtype)
    for step, rows in enumerate(order.T):
        rate, linear = rates[rows][..., None], slides[rows][..., None]
        angle = jnp.where(linear, 0, rate)
        if not step:
            twist, path = angle, jnp.where(linear, rate, 0)
            continue
        before = order[:, step - 1]
        gap = coordinates(anchor[before] - anchor[rows])
        beside = norm(cross(gap, coordinates(axis[rows])))
        rho = beside + stroke[before] + length
        path = path + jnp.where(rate > 0, rate * jnp.where(linear, 1, rho[:, None]), 0)
        turn = turn + angle
        length = length + norm(gap) + stroke[before]
    travel = jnp.stack(jnp.broadcast_arrays(twist, path, turn), 1)
    if any(way.held for way in ways.ways):
        travel = jnp.where(ways.so(world)[:, None, None], travel, 0)
    return travel, extents(scene, world, ways, poses)
