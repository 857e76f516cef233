"""Speed, side by side: ours and its peers in one run on one machine.

    python eval/benchmark.py --out runs/benchmark.json

Sides take turns within each round, so that a busy machine slows all of them alike; what
counts is the ratio. Cores that a side really got are measured too. Compilation is timed
apart. Peers get the same geoms and the same pairs, joint states prepared beforehand, and
are spared what the question does not need (friction).
"""

import json
import os
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco.batch import Batch
from tqdm import tqdm

from jaxplan.cli import run_script
from jaxplan.collision import XLA_OPTIONS, World, clearance, config_free, make_world
from jaxplan.collision.certify import carry, qpos_rows
from jaxplan.evaluation import versions
from jaxplan.scene import Scene, find_contacts, geom_pairs
from jaxplan.scene.quiet_mjx import mjx
from jaxplan.tasks.mug.scene import build

OURS = "jaxplan config_free"
BATCH = "mujoco.batch, all cores"


@dataclass(frozen=True)
class Args:
    """Measures collision queries on the mug scene."""

    out: Path = Path("runs/benchmark.json")
    rounds: int = 30
    """Measurements of each side."""
    batch: int = 4096
    mjx_batch: int = 256
    """Configurations in a call of `mjx.collision`, which is slow."""


class Side(NamedTuple):
    """Something to measure."""

    name: str
    call: Callable[[], Any]
    """Answers for `size` configurations; returns when done."""
    size: int
    compile_seconds: float | None = None


@dataclass(frozen=True)
class Row:
    """What was measured of one side."""

    scene: str
    side: str
    batch: int
    per_second: float
    """Median over the rounds [configurations/s]."""
    p10: float
    p90: float
    cores_busy: float
    """CPU time over wall time, median."""
    compile_seconds: float | None


def main(args: Args) -> None:
    """Measures, prints a table, writes JSON."""
    scene = Scene.from_mjcf(build("planning"))
    rows, agreement = [], {}
    for name, world in worlds(scene).items():
        sides, verdicts = collision_sides(scene, world, args)
        agreement[name] = float(np.mean(verdicts[0] == verdicts[1]))
        rows += measure(name, sides, args.rounds)
    kinds: Counter[str] = Counter()
    for contact in (c for group in scene.groups for c in group.contacts):
        kinds[f"{contact.a.kind}/{contact.b.kind}"] += len(geom_pairs(contact))
    result = {
        "collision": [asdict(row) for row in rows],
        "ratios": ratios(rows),
        "verdicts_equal": agreement,
        "pairs": len(scene.pairs),
        "pairs_by_kind": dict(kinds),
        "pair_list": [list(pair) for pair in scene.pairs],
        "rounds": args.rounds,
        "load": os.getloadavg(),
        "versions": versions(),
    }
    args.out.parent.mkdir(parents=True, exist_ok=True)
    args.out.write_text(json.dumps(result, indent=1) + "\n")
    show(result)
    print(f"written to {args.out}")


def worlds(scene: Scene) -> dict[str, World]:
    """The mug on the table, and the mug in the hand, below the fingers."""
    held = make_world(scene, [[0.0, 0, 0.19, 1, 0, 0, 0]], [True], [0.002, 0.002])
    return {"mug on the table": make_world(scene), "mug in the hand": held}


def collision_sides(
    scene: Scene, world: World, args: Args
) -> tuple[list[Side], tuple[np.ndarray, np.ndarray]]:
    """All sides on random configurations, and the verdicts of ours and of C MuJoCo."""
    rng = np.random.default_rng(0)
    shape = args.batch, len(scene.joints)
    q = rng.uniform(scene.q_min, scene.q_max, shape).astype(np.float32)
    model = peer_model(scene, held=bool(world.held.any()))
    qpos = peer_states(scene, model, world, q)
    data, batch = mujoco.MjData(model), Batch(model, args.batch)
    batch.qpos[:] = qpos
    contacts = batch.bind("ncon")

    def c_loop() -> None:
        for row in qpos:
            data.qpos[:] = row
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)

    mjx_model, empty = mjx.put_model(model), mjx.make_data(model)

    def mjx_free(rows: jax.Array) -> jax.Array:
        def one(row: jax.Array) -> jax.Array:
            moved = mjx.kinematics(mjx_model, empty.replace(qpos=row))
            return mjx.collision(mjx_model, moved)._impl.contact.dist.min() > 0

        return jax.vmap(one)(rows)

    def ours(function: Callable) -> tuple[Callable, float]:
        return compiled(lambda q: function(scene, world, q), jnp.asarray(q))

    free, free_seconds = ours(config_free)
    exact, exact_seconds = ours(clearance)
    reference, mjx_seconds = compiled(mjx_free, jnp.asarray(qpos[: args.mjx_batch]))
    sides = [
        Side(OURS, free, args.batch, free_seconds),
        Side("jaxplan clearance", exact, args.batch, exact_seconds),
        Side(
            BATCH,
            lambda: batch.forward(stage=mujoco.mjtStage.mjSTAGE_POS.value),
            args.batch,
        ),
        Side("MuJoCo C loop, one core", c_loop, args.batch),
        Side("mjx.collision", reference, args.mjx_batch, mjx_seconds),
    ]
    sides[2].call()
    return sides, (np.asarray(free()), np.array(contacts).ravel() == 0)


def peer_model(scene: Scene, held: bool) -> mujoco.MjModel:
    """The model with exactly the pairs that count on our side.

    A mug that is not held does not move with the arm, so nothing that is at rest is
    checked against it. Contacts become the cheapest constraints, without friction.
    """
    model = build("planning")
    names = [model.geom(geom).name for geom in range(model.ngeom)]
    if not held:
        mug_spheres = [name.startswith("mug_sphere") for name in names]
        base = [name.startswith("link0_") for name in names]
        model.geom_contype[mug_spheres] = 0
        # The base keeps its bits for the arm and gives up those of the mug's boxes.
        model.geom_conaffinity[base] &= ~model.geom("mug_wall0").contype
    model.geom_condim[:], model.opt.cone = 1, mujoco.mjtCone.mjCONE_PYRAMIDAL
    counted = [g for g in scene.groups if held or not g.held]
    ours = sum(len(geom_pairs(c)) for g in counted for c in g.contacts)
    theirs = sum(len(geom_pairs(c)) for c in find_contacts(model))
    if ours != theirs:
        raise RuntimeError(f"{ours} pairs on our side, {theirs} on the peers'")
    return model


def peer_states(
    scene: Scene, model: mujoco.MjModel, world: World, q: np.ndarray
) -> np.ndarray:
    """`[n, nq]` joint positions, a held mug already carried to where the hand is."""
    many = World(*(np.broadcast_to(x, (len(q), *x.shape)) for x in world))  # type: ignore
    rows, data = qpos_rows(scene, many, q), mujoco.MjData(model)
    for row in rows:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        carry(scene, data, np.asarray(world.held))
        row[:] = data.qpos
    return rows


def compiled(function: Callable, argument: jax.Array) -> tuple[Callable, float]:
    """The function ready to call on the argument, and how long compilation took [s]."""
    start = time.perf_counter()
    program = jax.jit(function).lower(argument).compile(compiler_options=XLA_OPTIONS)
    seconds = time.perf_counter() - start
    return lambda: jax.block_until_ready(program(argument)), seconds


def measure(scene: str, sides: list[Side], rounds: int) -> list[Row]:
    """Lets the sides take turns."""
    rates = np.zeros((len(sides), rounds))
    busy = np.zeros((len(sides), rounds))
    for turn in tqdm(range(rounds), desc=scene, unit="round"):
        for index, side in enumerate(sides):
            side.call()  # the one before left the caches to itself
            wall, cpu = time.perf_counter(), time.process_time()
            side.call()
            seconds = time.perf_counter() - wall
            rates[index, turn] = side.size / seconds
            busy[index, turn] = (time.process_time() - cpu) / seconds
    rows = []
    for side, rate, cores in zip(sides, rates, busy, strict=True):
        p10, median, p90 = (float(x) for x in np.percentile(rate, [10, 50, 90]))
        rows.append(
            Row(
                scene,
                side.name,
                side.size,
                median,
                p10,
                p90,
                float(np.median(cores)),
                side.compile_seconds,
            )
        )
    return rows


def ratios(rows: list[Row]) -> dict[str, float]:
    """Median speed of `config_free` over that of each peer.

    On a busy machine a peer with a thread per core gets fewer cores than it could use, which
    flatters us. The second ratio to it supposes that it scales perfectly to all of them, and
    leaves ours as measured: a lower bound.
    """
    ours = {row.scene: row.per_second for row in rows if row.side == OURS}
    found = {}
    for row in rows:
        if row.side.startswith("jaxplan"):
            continue
        name = f"{row.scene}: {OURS} / {row.side}"
        found[name] = ours[row.scene] / row.per_second
        if row.side == BATCH:
            scale = max(1.0, (os.cpu_count() or 1) / row.cores_busy)
            found[f"{name}, scaled to {os.cpu_count()} cores"] = found[name] / scale
    return found


def show(result: dict) -> None:
    """Prints the table."""
    print(f"{result['pairs']} pairs: {result['pairs_by_kind']}")
    print(f"{'scene':18}{'side':26}{'configurations/s (p10 to p90)':34}cores  compile")
    for row in result["collision"]:
        spread = f"{row['p10']:,.0f} to {row['p90']:,.0f}"
        speed = f"{row['per_second']:,.0f} ({spread})"
        seconds = row["compile_seconds"]
        built = "" if seconds is None else f"{seconds:.1f} s"
        line = f"{row['scene']:18}{row['side']:26}{speed:34}{row['cores_busy']:.1f}"
        print(f"{line:83}  {built}")
    for name, ratio in result["ratios"].items():
        print(f"{name}: {ratio:.1f}")
    for name, share in result["verdicts_equal"].items():
        print(f"{name}: verdicts equal to C MuJoCo's in {100 * share:.3f} %")


if __name__ == "__main__":
    run_script(main, Args)
