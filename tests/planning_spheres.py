"""Problems among spheres in joint space, and a sequential planner to compare with.

The planner is plain NumPy, one problem and one expansion at a time.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.planning import Segment, points_for
from jaxplan.planning.proposal import draw_numbers

Q_MAX = 2.0


class Spheres(NamedTuple):
    """Obstacles of P problems: centres `[P, S, d]`, radii `[P, S]` [rad]."""

    centre: np.ndarray
    radius: np.ndarray


def config_free(worlds, problem, q):
    """Of NumPy and of JAX arrays alike."""
    gap = q[:, None] - worlds.centre[problem]
    return ((gap**2).sum(-1) > worlds.radius[problem] ** 2).all(-1)


def points_free(worlds, problem, q0, q1, points):
    """Whether the places on motions that a planner checks are free; of NumPy arrays."""
    share = (np.arange(points) + 1)[:, None, None] / points
    return np.all(
        [config_free(worlds, problem, q) for q in q0 + share * (q1 - q0)], axis=0
    )


def problems(count, d=7, spheres=12, seed=0):
    """Worlds in which the straight motion is blocked, starts, goals, keys.

    The first sphere lies between start and goal. The spheres leave a way around: each is
    shrunk until it holds neither end, and 12 small balls cannot wall off a 7-D box.
    """
    rng = np.random.default_rng(seed)
    q_start = rng.uniform(-1.6, 1.6, (count, d))
    step = rng.normal(size=(count, d))
    step *= rng.uniform(0.8, 1.6, (count, 1)) / np.linalg.norm(step, axis=-1)[:, None]
    q_goal = np.clip(q_start + step, -1.8, 1.8)
    centre = rng.uniform(-Q_MAX, Q_MAX, (count, spheres, d))
    centre[:, 0] = (q_start + q_goal) / 2 + 0.05 * rng.normal(size=(count, d))
    ends = np.stack([q_start, q_goal], 1)
    room = np.linalg.norm(ends[:, :, None] - centre[:, None], axis=-1).min(1)
    radius = np.minimum(rng.uniform(0.3, 0.8, (count, spheres)), room - 0.08)
    worlds = Spheres(centre.astype(np.float32), radius.clip(0.01).astype(np.float32))
    keys = jax.vmap(jax.random.key)(jnp.arange(count) + 1000 * seed)
    return worlds, q_start.astype(np.float32), q_goal.astype(np.float32), keys


def noisy_sampler(q_start, q_goal, keys, rows=8, based=False):
    """Segments roughly from start to goal; segment j depends on the key and j alone.

    With `based` they say that they begin beside the straight motion.
    """
    return lambda bank_number: _noisy_segments(
        q_start, q_goal, keys, bank_number, rows, based
    )


@partial(jax.jit, static_argnums=(4, 5))
def _noisy_segments(q_start, q_goal, keys, bank_number, rows, based):
    d = q_start.shape[1]

    def one(key, j):
        key = jax.random.fold_in(jax.random.fold_in(key, 7), j)
        return jax.random.uniform(key, (d + 1,), minval=-1, maxval=1)

    index = bank_number[:, None] * rows + jnp.arange(rows)
    noise = jax.vmap(jax.vmap(one, (None, 0)))(keys, index)
    gap = q_goal - q_start
    straight = gap / jnp.linalg.norm(gap, axis=-1, keepdims=True)
    share = jnp.abs(noise[..., 1:2])
    base = q_start[:, None] + share * gap[:, None] + 0.3 * noise[..., 1:]
    return Segment(
        straight[:, None] + 0.5 * noise[..., 1:],
        0.15 + 0.15 * noise[..., 0],
        base if based else None,
    )


class Oracle:
    """One problem, one expansion after the other, no cleverness."""

    def __init__(self, world, q_start, q_goal, q_toggle, key, segments, config):
        d = q_start.size
        k = jnp.arange(config.max_expansions)
        limits = jnp.full(d, -Q_MAX), jnp.full(d, Q_MAX)
        numbers = draw_numbers(key[None], k[None], limits, config)
        self.draws = jax.tree.map(lambda x: np.asarray(x[0]), numbers)
        self.world, self.segments, self.config = world, segments, config
        self.q_start, self.q_goal, self.q_toggle = q_start, q_goal, q_toggle
        self.q, self.parent, self.side = [q_start], [-1], [0]
        self.flags, self.used = [], 0

    def d(self, a, b):
        weight = 1 if self.config.metric is None else np.array(self.config.metric)
        return np.linalg.norm(weight * (np.asarray(a) - b), axis=-1)

    def nearest(self, target, side, tie_break=False):
        nodes = [i for i, s in enumerate(self.side) if s == side]
        gaps = self.d([self.q[i] for i in nodes], target)
        if not tie_break:
            return nodes[int(np.argmin(gaps))]
        tied = [
            i
            for i, gap in zip(nodes, gaps, strict=True)
            if gap <= gaps.min() + self.config.toggle_tie_break
        ]
        return min(tied, key=lambda i: self.d(self.q[i], self.q_toggle))

    def free(self, q0, q1):
        length = float(np.linalg.norm(np.float32(q1) - np.float32(q0)))
        points = points_for(length, self.config.edge_resolution)
        share = (np.arange(points, dtype=np.float32) + 1)[:, None] / points
        q = np.where(share == 1, q1, q0 + share * (q1 - q0))[:, None]
        gap = ((q - self.world.centre) ** 2).sum(-1)
        return bool((gap > self.world.radius**2).all())

    def move(self, base, side, target, length, direction=None):
        """Tries one motion; returns the new node (None: rejected) and if it is target."""
        gap = target - self.q[base]
        reached = direction is None and np.linalg.norm(gap) <= 1.0001 * length
        if direction is None:
            direction = gap / max(np.linalg.norm(gap), 1e-9)
        q_new = np.clip(self.q[base] + length * direction, -Q_MAX, Q_MAX)
        q_new = target if reached else q_new.astype(np.float32)
        stands_still = np.linalg.norm(q_new - self.q[base]) <= 1e-6 and not reached
        ok = not stands_still and self.free(self.q[base], q_new)
        self.flags.append(ok)
        if not ok:
            return None, False
        self.q.append(q_new)
        self.parent.append(base)
        self.side.append(side)
        return len(self.q) - 1, reached

    def expand(self, side, goal):
        """Lines 8 to 20 of Algorithm 1 in tree `side`.

        Returns:
            The new node or None, and where to follow a segment from there, or None.
        """
        config, k = self.config, len(self.flags)
        draw = jax.tree.map(lambda x: x[k], self.draws)
        learns = side == 0 or config.goal_tree == "mirrored"
        if self.segments is not None and draw.learned and learns:
            u = np.asarray(self.segments.direction[self.used])
            s = np.asarray(self.segments.length[self.used])
            self.used += 1
            if np.isfinite(u).all() and np.isfinite(s) and np.linalg.norm(u) > 1e-6:
                u = (u if side == 0 else -u) / np.linalg.norm(u)
                target, direction, end = goal, u, None
                if self.segments.base is not None:
                    begin = np.asarray(self.segments.base[self.used - 1])
                    end = begin + s * u if side == 0 else begin
                    end = np.clip(end, -Q_MAX, Q_MAX)
                    target, direction = end, None
                s = np.clip(s, config.step_min, config.step_max)
                base = self.nearest(target, side, config.toggle_tie_break > 0)
                node, reached = self.move(base, side, target, s, direction)
                return node, None if reached else end
        length, direction = draw.segment.length, None
        target = goal if draw.goal else draw.q_rand
        if not draw.goal and config.uniform_mode == "independent":
            direction = draw.segment.direction
        base = self.nearest(target, side)
        node, reached = self.move(base, side, target, length, direction)
        onward = config.greedy and direction is None and not reached
        return node, target if onward else None

    def left(self):
        return len(self.flags) < self.config.max_expansions

    def chain(self, node, side, target):
        """Straight steps from `node` (None: the nearest one); whether they arrive."""
        node = self.nearest(target, side) if node is None else node
        while self.left():
            node, reached = self.move(node, side, target, self.config.step_max)
            if node is None or reached:
                return reached
        return False

    def rrt(self):
        config, node, end = self.config, 0, None
        while True:
            if node is not None:
                gap = self.d(self.q[node], self.q_goal)
                if 0 < gap <= config.goal_connect and self.left():
                    self.chain(node, 0, self.q_goal)
                    end = None
                best = self.q[self.nearest(self.q_goal, 0)]
                if self.d(best, self.q_goal) <= config.goal_tolerance:
                    return True
            if not self.left():
                return False
            if node is not None and end is not None:
                node, reached = self.move(node, 0, end, config.step_max)
                end = None if reached else end
            else:
                node, end = self.expand(0, self.q_goal)

    def rrt_connect(self):
        self.q.append(self.q_goal)
        self.parent.append(-1)
        self.side.append(1)
        if self.chain(None, 0, self.q_goal):
            return True
        side, ends = 0, (self.q_start, self.q_goal)
        while self.left():
            node, end = self.expand(side, ends[1 - side])
            newest = node
            while newest is not None and end is not None and self.left():
                newest, reached = self.move(newest, side, end, self.config.step_max)
                node = node if newest is None else newest
                end = None if reached else end
            if node is not None and self.chain(None, 1 - side, self.q[node]):
                return True
            side = 1 - side
        return False
