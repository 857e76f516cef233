"""Collision queries per second: ours, MuJoCo's own three ways, PyBullet.

Peers get the same geoms and the same pairs, joint states prepared beforehand, and are
spared what the question does not need (friction).
"""

import os
from collections.abc import Callable
from dataclasses import replace
from itertools import chain
from pathlib import Path

import jax
import mujoco
import numpy as np
from mujoco.batch import Batch
from peers import absent

from jaxplan.collision import clearance, clearance_mujoco, config_free
from jaxplan.scene.quiet_mjx import mjx
from parts.collision_cases import Case, mug_cases, panda_cases
from parts.rows import Part, Ratio, Row, compare
from parts.turns import Side, compiled, take_turns

PART = "collision"
OURS, EXACT = "jaxplan config_free", "jaxplan clearance"
BATCH = "mujoco.batch, all cores"
PYBULLET = "PyBullet, one core"
BAND = 1e-4
"""Closer to contact than this [m], which side of it a configuration is on is rounding."""
LEAST = 0.7
ROWS = 4096
SLOW = "table", "mug in the hand"
"""Scenes that a quick run leaves out."""
MJX_ROWS = 64
"""Configurations in a call of `mjx.collision`, which is slow."""


def measure(quick: bool, data: Path) -> Part:
    """All scenes; without the spheres' data the mug's alone, and a row that says so."""
    rows: list[Row] = []
    ratios: dict[str, Ratio] = {}
    counts: dict[str, int] = {}
    cases = mug_cases(ROWS)
    try:
        cases = chain(list(panda_cases(data, ROWS)), cases)
    except FileNotFoundError as error:
        rows.append(Row(PART, "Panda as spheres", "all sides", note=str(error)))
    for case in cases:
        if quick and case.name in SLOW:
            continue
        sides, verdicts, lacking = sides_of(case, reference=not quick)
        measured = take_turns(
            PART, case.name, "configurations/s", sides, 5 if quick else 30
        )
        ratios |= compare(measured, OURS, LEAST) | bound(measured)
        wrong = disagreements(case, verdicts)
        rows += [
            replace(row, more=row.more | wrong.get(row.side, {})) for row in measured
        ]
        rows += lacking
        for side in (OURS, EXACT):
            name = f"{PART}, {case.name}: wrong verdicts of {side}"
            counts[name] = wrong[side]["wrong"]
    return Part(rows, ratios, counts)


Verdicts = dict[str, Callable[[], np.ndarray]]
"""`[n]` bool of a side: which configurations are free."""


def sides_of(case: Case, reference: bool) -> tuple[list[Side], Verdicts, list[Row]]:
    """Sides, what the verdicts of some are, and rows for those that are not here.

    Args:
        case: The scene.
        reference: With `mjx.collision`, which takes long to compile.
    """
    model, qpos, rows = case.model, case.qpos, len(case.q)
    data, batch = mujoco.MjData(model), Batch(model, rows)
    batch.qpos[:] = qpos
    contacts = batch.bind("ncon")

    def c_loop() -> None:
        for row in qpos:
            data.qpos[:] = row
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)

    def all_cores() -> None:
        batch.forward(stage=mujoco.mjtStage.mjSTAGE_POS.value)

    def ours(function: Callable) -> tuple[Callable, float]:
        scene = case.scene
        return compiled(lambda world, q: function(scene, world, q), case.world, case.q)

    free, free_seconds = ours(config_free)
    exact, exact_seconds = ours(clearance)
    sides = [
        Side(OURS, free, rows, free_seconds),
        Side(EXACT, exact, rows, exact_seconds),
        Side(BATCH, all_cores, rows),
        Side("MuJoCo C loop, one core", c_loop, rows),
    ]
    if reference:
        sides.append(mjx_side(model, qpos[:MJX_ROWS].astype(np.float32)))
    verdicts: Verdicts = {
        OURS: lambda: np.asarray(free()),
        EXACT: lambda: np.asarray(exact()) > 0,
        BATCH: lambda: (all_cores(), np.array(contacts).ravel() == 0)[1],
    }
    lacking: list[Row] = []
    if case.robot is None:
        pass  # PyBullet has no mug
    elif reason := absent("pybullet"):
        lacking.append(Row(PART, case.name, PYBULLET, note=reason))
    else:
        from peers.pybullet_peer import PybulletChecker

        checker = PybulletChecker(case.robot, case.obstacles)
        sides.append(Side(PYBULLET, lambda: checker.config_free(qpos), rows))
        verdicts[PYBULLET] = lambda: checker.config_free(qpos)
    return sides, verdicts, lacking


def mjx_side(model: mujoco.MjModel, rows: np.ndarray) -> Side:
    """MJX's own checker, compiled with the options that help ours."""
    mjx_model, empty = mjx.put_model(model), mjx.make_data(model)

    def free(rows: jax.Array) -> jax.Array:
        def one(row: jax.Array) -> jax.Array:
            moved = mjx.kinematics(mjx_model, empty.replace(qpos=row))
            return mjx.collision(mjx_model, moved)._impl.contact.dist.min() > 0

        return jax.vmap(one)(rows)

    call, seconds = compiled(free, rows)
    return Side("mjx.collision", call, len(rows), seconds)


def bound(rows: list[Row]) -> dict[str, Ratio]:
    """A lower bound of the ratio to `mujoco.batch`.

    On a busy machine a peer with a thread per core gets fewer cores than it could use, which
    flatters us. This supposes that it scales perfectly to all of them, and leaves ours as
    measured.
    """
    (ratio,) = (r for r in compare(rows, OURS, LEAST).items() if r[1].against == BATCH)
    (row,) = (row for row in rows if row.side == BATCH)
    cores = os.cpu_count() or 1
    scale = max(1.0, cores / max(row.more["cores"], 0.1))
    value = ratio[1].value / scale
    name = f"{ratio[0]}, scaled to {cores} cores"
    return {name: Ratio(value, 0.0, BATCH)}  # it says too much of the load for a gate


def disagreements(case: Case, verdicts: Verdicts) -> dict[str, dict[str, int]]:
    """How many verdicts differ from C MuJoCo's, farther from contact than BAND."""
    distance = clearance_mujoco(case.scene, case.world, case.q)
    clear = np.abs(distance) > BAND
    return {
        side: {"wrong": int(((free() != (distance > 0)) & clear).sum())}
        for side, free in verdicts.items()
    }
