"""Signed distances of every pair of kinds against C MuJoCo, and their laws."""

from functools import cache
from itertools import combinations_with_replacement
from types import SimpleNamespace
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from quick import jit

from jaxplan.collision.convex import least_convex
from jaxplan.collision.hulls import read_hulls
from jaxplan.collision.narrow import CLOSED, SOLID
from jaxplan.collision.shapes import Score, Shapes, in_world, read

BAND = 1e-4
MARGIN = 0.01
ROWS = 128
VERTICES = 10_000
PAIRS = [
    *CLOSED,
    *(pair for pair in combinations_with_replacement(SOLID, 2) if pair not in CLOSED),
]
CUBE = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T


def geom_type(kind: str) -> mujoco.mjtGeom:
    return getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}")


def points_of_mesh(size: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A tetrahedron, something with seven corners, or something nearly round."""
    points = rng.normal(size=(rng.choice([4, 7, 50]), 3))
    if len(points) == 50:
        points /= np.linalg.norm(points, axis=-1, keepdims=True)
    return points * size


def two_geoms(kinds: tuple[str, str], seed: int, oracle: bool) -> mujoco.MjModel:
    """Two bodies, each with a geom that does not sit in its origin."""
    rng, spec = np.random.default_rng(seed), mujoco.MjSpec()
    for name, kind in zip("ab", kinds, strict=True):
        size = np.exp(rng.uniform(np.log(0.02), np.log(0.3), 3))
        body = spec.worldbody.add_body(name=name)
        geom = body.add_geom(name=name, type=geom_type(kind), size=size)
        geom.pos, geom.quat = rng.normal(size=3) * 0.05, rng.normal(size=4)
        if kind != "plane":
            body.add_freejoint()
        points = points_of_mesh(size, rng) if kind == "mesh" else None
        if oracle and kinds == ("capsule", "box") and kind == "box":
            # C MuJoCo calls a capsule free whose axis pierces a box; a mesh it does not.
            geom.type, points = geom_type("mesh"), CUBE * size
        if points is not None:
            spec.add_mesh(name=name, uservert=points.ravel())
            geom.meshname = name
    return spec.compile()


def move(model: mujoco.MjModel, data: mujoco.MjData, rng: np.random.Generator) -> float:
    """Puts the geoms apart, near contact or deep into each other; their distance."""
    quats, toward = rng.normal(size=(2, 4)), rng.normal(size=3)
    if rng.random() < 0.2:
        quats[1] = quats[0]
    toward /= np.linalg.norm(toward)
    positions = np.zeros((2, 3)) + rng.normal(size=3) * 0.3
    positions[0] += toward * model.geom_rbound.sum() * rng.uniform(0, 1.2)
    data.qpos[:] = np.concatenate([positions, quats], 1).ravel()[: model.nq]
    near, distance = rng.random() < 0.5, 0.0
    for step in range(4 if near else 1):
        if step:
            data.qpos[:3] -= toward * (distance + rng.normal() * 0.002)
        mujoco.mj_kinematics(model, data)
        a, b = model.geom("a").id, model.geom("b").id
        distance = mujoco.mj_geomDistance(model, data, a, b, 10.0, None)
    return distance


def shapes(model: mujoco.MjModel, name: str, poses: np.ndarray) -> Shapes:
    """A geom in the world; hulls are filled up, so that one compilation serves all.

    Args:
        model: The model.
        name: Of the geom and its body.
        poses: `[B, 3, 4]` of its body.
    """
    scene: Any = SimpleNamespace(model=model, mj_model=model, shaped=())
    own = read(scene, (model.geom(name).id,))
    if own.hulls:
        fill = [(0, 0), (0, VERTICES - own.hulls.vertices.shape[1])]
        padded = jnp.pad(own.hulls.vertices, fill, mode="edge")
        own = own._replace(hulls=own.hulls._replace(vertices=padded))
    batch_last = jnp.asarray(np.moveaxis(poses, 0, -1)[None], jnp.float32)
    return in_world(own, batch_last, np.zeros(1, int))


@cache
def samples(
    kinds: tuple[str, str], models: int = 8
) -> list[tuple[Shapes, Shapes, np.ndarray]]:
    """Geoms, obstacles and distances `[ROWS]`, of several sizes."""
    rng, found = np.random.default_rng(0), []
    for seed in range(models):
        model, seen = (two_geoms(kinds, seed, oracle) for oracle in (False, True))
        data, distances, poses = mujoco.MjData(seen), [], {"a": [], "b": []}
        for _ in range(ROWS):
            distances.append(move(seen, data, rng))
            for name, rows in poses.items():
                body = data.body(name)
                rows.append(np.c_[body.xmat.reshape(3, 3), body.xpos])
        a, b = (shapes(model, name, np.array(rows)) for name, rows in poses.items())
        found.append((a, b, np.array(distances)))
    return found


@cache
def rated(kinds: tuple[str, str]):
    """Jitted: distance, whether free, whether farther apart than a margin."""

    def least(a: Shapes, b: Shapes, score: Score) -> jax.Array:
        if kinds in CLOSED:
            return CLOSED[kinds](a, b, score)[0]
        parts = list(zip(kinds, (a, b), strict=True))
        return least_convex(parts, np.array([[0, 1]]), jnp.ones((1, 1), bool), score)

    def rate(a: Shapes, b: Shapes, margin: jax.Array):
        free = least(a, b, Score(exact=False, margin=margin)) > 0
        return least(a, b, Score(exact=True)), free

    return jit(rate)


def cores_apart(kinds, a: Shapes, b: Shapes, distance: np.ndarray) -> np.ndarray:
    """Whether only the radii of spheres and capsules overlap."""
    radius = sum(
        np.asarray(shape.size[0])[0]
        for kind, shape in zip(kinds, (a, b), strict=True)
        if kind in ("sphere", "capsule")
    )
    return distance + radius > BAND


@pytest.mark.parametrize("kinds", PAIRS, ids="/".join)
def test_every_pair_of_kinds_agrees_with_mujoco(kinds: tuple[str, str]):
    excess, errors = [], []
    for a, b, expected in samples(kinds):
        distance, free = map(np.asarray, rated(kinds)(a, b, 0.0))
        apart = expected > 0
        clear = np.abs(expected) > BAND
        np.testing.assert_array_equal((distance > 0)[clear], apart[clear])
        np.testing.assert_array_equal(free[clear], apart[clear])
        np.testing.assert_allclose(distance[apart], expected[apart], atol=BAND)
        errors.append(np.abs(distance - expected)[apart])
        _, beyond = rated(kinds)(a, b, MARGIN)
        clear = np.abs(expected - MARGIN) > BAND
        np.testing.assert_array_equal(beyond[clear], (expected > MARGIN)[clear])
        shallow = ~apart & cores_apart(kinds, a, b, expected)
        np.testing.assert_allclose(distance[shallow], expected[shallow], atol=BAND)
        excess.append((expected - distance)[~apart & ~shallow])
    # Searches that stall next to contact leave less than the band.
    assert np.quantile(np.concatenate(errors), 0.95) < 1e-5
    over = np.concatenate(excess)
    assert over.min(initial=0) > -1e-5  # never less deep than it is
    if "plane" in kinds or set(kinds) <= {"sphere", "capsule", "box"}:
        assert over.max(initial=0) < 1e-5
    assert np.quantile(np.append(over, 0.0), 0.9) < 5e-3


def test_of_a_hull_the_farthest_vertex_is_found():
    spec = mujoco.MjSpec()
    rng, turn = np.random.default_rng(0), np.linspace(0, 2 * np.pi, 90, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)
    rods = np.concatenate(
        [ring, ring + np.array([0, 0, 3])]
    )  # many vertices around two poles
    for k, points in enumerate([CUBE, rods, rng.normal(size=(300, 3))]):
        spec.add_mesh(name=f"{k}", uservert=0.1 * points.ravel())
        for _ in range(2):
            spec.worldbody.add_geom(type=geom_type("mesh"), meshname=f"{k}")
    model = spec.compile()
    along = rng.normal(size=(3, model.ngeom, 500)).astype(np.float32)
    along[..., :250] = np.round(along[..., :250])  # borders of cells among them
    found = np.array(read_hulls(model, (*range(model.ngeom),)).farthest([*along]))
    for geom, mesh in enumerate(model.geom_dataid):
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        heights = model.mesh_vert[start : start + count] @ along[:, geom]
        own = (found[:, geom] * along[:, geom]).sum(0)
        np.testing.assert_allclose(own, heights.max(0), atol=1e-6)
