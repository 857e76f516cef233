"""Table 3: time per learned proposal, planner excluded.

    python eval/proposal_time.py

Three settings, 500 proposals of each sampler, sides taking turns:

    one at a time        the shipped networks at batch 1, as in the paper; the diffusion
                         network in PyTorch beside them
    a phase's bank       the same networks, a bank of segments for each of a batch's episodes
                         in one call: what a search pays for a proposal
    the paper's network  U-Net (64, 128, 256) with random weights, one at a time

The image's features are given: an image is encoded once a phase, whoever samples, and how
long that takes is printed too.
"""

import time
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
from parts.proposal_speed import torch_sides
from parts.rows import Row
from parts.turns import Side, compiled, take_turns
from peers import absent, peer_versions

from jaxplan.cli import run_script
from jaxplan.data import IMAGE_SHAPE
from jaxplan.evaluation.recorded_study import results
from jaxplan.evaluation.result import Result
from jaxplan.evaluation.tables import Table
from jaxplan.networks import Cond, SamplerConfig, predict
from jaxplan.pretrained import (
    DIRECTORY,
    UPPER,
    Weights,
    WeightsError,
    load_weights,
)
from jaxplan.ranges import Checked, Count
from jaxplan.samplers import draw, init
from jaxplan.samplers.bank import SIZE

PART = "Table 3"
ONE, PHASE, PAPER = "one at a time", "a phase's bank", "the paper's network"
DDIM = "DDIM 25"
PUBLISHED = {DDIM: 1.0, "DDIM 10": 0.42, "CVAE": 0.09, "GAN": 0.11}
"""Times per proposal of the paper's Table 3, DDIM 25 = 1."""
NOTES = {
    ONE: "The shipped networks at batch 1, and the diffusion network in PyTorch; in the last row "
    "what a phase costs beside its proposals.",
    PHASE: "What a search pays: 32 segments for each of 32 episodes in one call.",
    PAPER: "U-Net (64, 128, 256) with random weights, at batch 1.",
}
EPISODES = 32
"""Episodes of a batch whose phases are drawn for together."""


@dataclass(frozen=True)
class Args(Checked):
    """Measures how long each sampler takes for a proposal."""

    proposals: Count = 500
    """Of each sampler, one at a time; a tenth as many calls for a phase's bank."""
    quick: bool = False
    """50 proposals."""
    weights: Path = DIRECTORY
    out: Path | None = None
    """JSON; by default in `eval/results`, of a quick run in `runs`."""


def main(args: Args) -> None:
    """Measures, prints the table, writes JSON."""
    count = min(args.proposals, 50) if args.quick else args.proposals
    samplers, notes = shipped(args.weights)
    upper = load_weights(UPPER, args.weights)
    features = upper.config.encoder.features * (1 + upper.config.encoder.average)
    large = SamplerConfig(encoder=None)
    network = Weights(
        large, jax.jit(partial(init, large, image=(features,)))(jax.random.key(0)), {}
    )
    unet = {
        DDIM: network,
        "DDIM 10": network._replace(config=replace(large, num_inference_steps=10)),
    }
    ones = [side(name, w, features, 1, 1) for name, w in samplers.items()]
    many = [side(name, w, features, EPISODES, SIZE) for name, w in samplers.items()]
    big = [side(name, w, features, 1, 1) for name, w in unet.items()]
    if DDIM in samplers:
        ones += torch_peer(samplers[DDIM].config)
    big += torch_peer(large)
    start = time.perf_counter()
    measured = {
        ONE: times(ONE, [*ones, encoding(upper)], count),
        PHASE: times(PHASE, many, max(5, count // 10)),
        PAPER: times(PAPER, big, count),
    }
    shares = checks(measured)
    result = Result(
        tables=[table(setting, rows) for setting, rows in measured.items()],
        settings={
            "proposals": count,
            "bank": [EPISODES, SIZE],
            "weights": {name: w.info["sha256"] for name, w in samplers.items()},
            "configs": {name: asdict(w.config) for name, w in samplers.items()},
            "peers": peer_versions(),
            "checks": shares,
        },
        shortfalls=[*notes, *shortfalls(shares)],
        quick=args.quick,
        seconds=time.perf_counter() - start,
    )
    result.show()
    out = args.out or results(args.quick) / "proposal_time.json"
    result.write(out)
    print(f"written to {out}")


def shipped(directory: Path) -> tuple[dict[str, Weights], list[str]]:
    """The samplers that are there by their name in the table, and why others are not."""
    samplers, notes = {}, []
    names = {"sampler": DDIM, "cvae": "CVAE", "gan": "GAN", "few_step": "few-step"}
    for name, title in names.items():
        try:
            weights = load_weights(name, directory)
        except WeightsError as error:
            notes.append(f"time of a proposal, {title}: {error}")
            continue
        if name == "sampler":
            for steps in (25, 10):
                config = replace(weights.config, num_inference_steps=steps)
                samplers[f"DDIM {steps}"] = weights._replace(config=config)
        else:
            samplers[title] = weights
    return samplers, notes


def side(
    name: str, weights: Weights, features: int, problems: int, segments: int
) -> Side:
    """One call of a sampler, condition network included, for conditions of zeros.

    The weights are part of the program, as in `samplers.Bank`.
    """
    config = weights.config
    joints = jnp.zeros((problems, len(config.q_min)))
    mode = jnp.zeros(problems, jnp.int32)
    cond = Cond(jnp.zeros((problems, features)), joints, mode, joints, mode, joints)
    keys = jax.random.split(jax.random.key(0), problems)

    def call(cond: Cond, keys: jax.Array) -> Any:
        return draw(config, weights.params, cond, keys, segments)

    program, seconds = compiled(call, cond, keys, options={})
    return Side(name, program, problems * segments, seconds)


def encoding(upper: Weights) -> Side:
    """The predictor on one picture, which gives targets and features: once a phase."""
    config = upper.config
    image = jnp.zeros((1, *IMAGE_SHAPE), jnp.uint8)
    q, gripper = jnp.zeros((1, len(config.q_min))), jnp.zeros(1, jnp.int32)
    program, seconds = compiled(
        partial(predict, config), upper.params, image, q, gripper, options={}
    )
    return Side("predictor, once a phase", program, 1, seconds)


def torch_peer(config: SamplerConfig) -> list[Side]:
    """DDIM 25 of the same network in PyTorch, where it is installed."""
    if absent("torch"):
        return []
    return torch_sides(replace(config, num_inference_steps=25))


def times(setting: str, sides: list[Side], rounds: int) -> dict[str, dict[str, Any]]:
    """Milliseconds per proposal of each side, and as a share of DDIM 25's."""
    rows = take_turns(PART, setting, "proposals/s", sides, rounds)
    found = {row.side: milliseconds(row) for row in rows}
    base = found.get(DDIM)
    if base is not None:
        for row in found.values():
            row["normalized"] = row["median"] / base["median"]
    return found


def milliseconds(row: Row) -> dict[str, Any]:
    """A row of rates as times."""
    assert row.median is not None
    assert row.p10 is not None
    assert row.p90 is not None
    return {
        "median": 1e3 / row.median,
        "p10": 1e3 / row.p90,
        "p90": 1e3 / row.p10,
        "size": row.size,
        **row.more,
    }


def table(setting: str, rows: dict[str, dict[str, Any]]) -> Table:
    """The times, the paper's figures beside ours."""
    columns = ["sampler", "ms", "10th %", "90th %", "DDIM 25 = 1", "paper"]
    cells = [
        [
            name,
            *(row[column] for column in ("median", "p10", "p90")),
            row.get("normalized"),
            PUBLISHED.get(name),
        ]
        for name, row in rows.items()
    ]
    return Table(f"Time of a proposal, {setting}", columns, cells, NOTES[setting])


def checks(measured: dict[str, dict[str, dict[str, Any]]]) -> dict[str, float]:
    """What the tables must show: shares of times of the same run."""
    one, phase = measured[ONE], measured[PHASE]
    found = {}
    for setting, rows in ((ONE, one), (PAPER, measured[PAPER])):
        if DDIM in rows:
            share = rows["DDIM 10"]["median"] / rows[DDIM]["median"]
            found[f"DDIM 10 / DDIM 25, {setting}"] = share
    peers = [row["median"] for name, row in one.items() if name.startswith("PyTorch")]
    if peers and DDIM in phase:
        share = phase[DDIM]["median"] / min(peers)
        found[f"DDIM 25, {PHASE} / PyTorch, {ONE}"] = share
    return found


def shortfalls(shares: dict[str, float]) -> list[str]:
    """Which of the checks fail."""
    lines = []
    for name, value in shares.items():
        most = 1 / 30 if "PyTorch" in name else 0.45
        if not value <= most:
            lines.append(f"time of a proposal, {name}: {value:.3f}, aim {most:.3f}")
    return lines


if __name__ == "__main__":
    run_script(main, Args)
