"""Closed surfaces of triangles: lofted tubes, solids of revolution, boxes. Only for looks."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

SECTORS = 24
"""Vertices around a round section; more is rounder and slower."""


class Surface(NamedTuple):
    """Triangles: `vertices` (n, 3) [m] and `faces` (m, 3), counter-clockwise from outside."""

    vertices: np.ndarray
    faces: np.ndarray


def loft(
    stations: Sequence[Sequence[float]],
    axes: str,
    steps: int = 2,
    sectors: int = SECTORS,
) -> Surface:
    """A closed tube through superelliptic sections, smooth from the first to the last.

    Args:
      stations: rows of (a, b, c, d, half width, shift, squareness); the last two may be absent.
      axes: which axes the section's ends (a, b), (c, d) and its width lie along, such as "yzx".
      steps: rings from one station to the next.
      sectors: vertices around each ring.
    """
    full = np.array([[*s, *(0, 2)[len(s) - 5 :]] for s in stations])
    a, b, c, d, width, shift, power = _smooth(full, steps).T[..., None]
    angle = np.linspace(0, 2 * np.pi, sectors, endpoint=False)
    along, across = (
        np.sign(f) * np.abs(f) ** (2 / power) for f in (np.cos(angle), np.sin(angle))
    )
    local = np.stack(
        [
            (a + c + (a - c) * along) / 2,
            (b + d + (b - d) * along) / 2,
            shift + width * across,
        ],
        axis=-1,
    )
    return _skin(local[..., np.argsort([*axes])])


def lathe(
    profile: Sequence[tuple[float, float]],
    axis: str,
    origin: Sequence[float] = (0, 0, 0),
) -> Surface:
    """A closed solid of revolution: rows of (radius, height) about `axis` through `origin`."""
    angle = np.linspace(0, 2 * np.pi, SECTORS, endpoint=False)
    radius, height = np.array(profile).T[..., None]
    local = np.stack(
        np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), height), -1
    )
    return _skin(np.roll(local, "zxy".index(axis), axis=-1) + np.array(origin))


def box(center: Sequence[float], half: Sequence[float] | np.ndarray) -> Surface:
    """A box with sides along the body's axes."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * half[:2]
    rings = [[(x, y, z) for x, y in corners] for z in (-half[2], half[2])]
    return _skin(np.array(rings) + center, flat=True)


def join(parts: Sequence[Surface]) -> Surface:
    """One surface of several."""
    first = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    return Surface(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate(
            [part.faces + start for part, start in zip(parts, first, strict=True)]
        ),
    )


def turn(
    surface: Surface, rotation: Sequence[Sequence[float]], x: float = 0
) -> Surface:
    """Shifts by `x` along the first axis, then rotates."""
    return surface._replace(
        vertices=(surface.vertices + np.array([x, 0, 0])) @ np.array(rotation).T
    )


def _smooth(rows: np.ndarray, steps: int) -> np.ndarray:
    """Catmull-Rom through `rows`, `steps` to each interval."""
    p = np.concatenate([[2 * rows[0] - rows[1]], rows, [2 * rows[-1] - rows[-2]]])
    p0, p1, p2, p3 = (p[i : len(p) - 3 + i, None] for i in range(4))
    t = np.linspace(0, 1, steps, endpoint=False)[None, :, None]
    curve = p1 + t / 2 * (
        p2 - p0 + t * (2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0))
    )
    return np.concatenate([curve.reshape(-1, rows.shape[1]), rows[-1:]])


def _skin(rings: np.ndarray, flat: bool = False) -> Surface:
    """Joins rings (k, n, 3) and closes both ends, with an edge between side and ends.

    MuJoCo averages normals over the faces that share a vertex, so an edge needs its own vertices.
    """
    count, n, _ = rings.shape
    i, j = np.meshgrid(np.arange(count - 1) * n, np.arange(n), indexing="ij")
    a, b = i + j, i + (j + 1) % n
    faces = np.stack([a, b, b + n, a, b + n, a + n], -1).reshape(-1, 3)
    fan = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], -1)
    side = Surface(rings.reshape(-1, 3), faces)
    if flat:
        side = Surface(
            side.vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
        )
    skin = join([side, Surface(rings[0], fan[:, ::-1]), Surface(rings[-1], fan)])
    # Six times the enclosed volume: negative when the rings ran clockwise.
    corner = skin.vertices[skin.faces]
    volume = np.linalg.det(corner - corner.mean((0, 1))).sum()
    return skin if volume > 0 else skin._replace(faces=skin.faces[:, ::-1])
