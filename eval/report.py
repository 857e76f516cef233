"""Writes RESULTS.md and the pages of results in `docs/` from the files in `eval/results/`.

    python eval/report.py

No figure is typed by hand: RESULTS.md has a summary of each section, its page all tables. A file
that is not there is a line that says which command makes it.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from parts import summary
from parts.summary import PAPER_ERROR, PAPER_NOMINAL, PAPER_SUCCESS, Found, rate, scene

from jaxplan.cli import run_script
from jaxplan.data import write_atomic
from jaxplan.evaluation.tables import Table, markdown, table
from jaxplan.pretrained.store import DIRECTORY, MANIFEST
from jaxplan.ranges import Checked

ROOT = Path(__file__).parents[1]
RESULTS = Path(__file__).parent / "results"


class Section(NamedTuple):
    """A heading, the files whose tables stand under it, and what differs from the paper."""

    page: str
    """Its file under `docs/`."""
    title: str
    files: tuple[str, ...]
    command: str
    """Makes the files; the JSON says what was really run."""
    differs: str
    summary: Callable[[Found], Table] | None


SUCCESS = ("success", "success_cluttered", "success_ways")
"""Files of `eval/success.py`, in the paper's setting."""

SECTIONS = (
    Section(
        "results/success",
        "Table 1, our row, and Table 5, nominal: success and toggle error",
        SUCCESS,
        "python eval/success.py --seeds 200000:200300 --out eval/results/success.json",
        "MuJoCo in place of PyBullet, our own mug, grasps that hold by friction alone. The paper's "
        "toggle error is to the nearest toggle of the episode; the stricter one is to the toggle "
        "that comes next, L2 over the joints.",
        summary.success,
    ),
    Section(
        "results/imitation",
        "Table 1: ours and imitation policies",
        (
            "imitation_plain",
            "imitation_strong",
            "imitation_cluttered",
            "convergence_diffusion_policy",
            "convergence_lstm_gmm",
        ),
        "python eval/imitation.py --seeds 200000:200300 --out eval/results/imitation_plain.json",
        "The same episodes, pictures and judge for all. The policies learned from whole episodes "
        "of the same expert at 10 Hz, with the same variation of camera, light and colours; they "
        "say 16 actions and have 8 of them executed. Which Transformer the paper compares with its "
        "reference leaves open: this is robomimic's, with a head for chunks. Their encoder is our "
        "predictor's, as it is; what stands behind it was trained 35 minutes on one core for "
        "LSTM-GMM and the Transformer (12,000 steps), three hours on one core, then on two, for "
        "Diffusion Policy (12,000, 8,000 and 20,000, each time with a fresh schedule). It got "
        "better each time, so this is no verdict on it yet. What else could hold it back was tried "
        "after 20,000 steps in 64 of these episodes, of which 30 succeed as it is: asked again "
        "after 4 actions instead of 8, 30; 50 steps of denoising instead of 16, 24. Times of a "
        "decision are beside other work."
        "\n\n![Episodes by how they ended, and a typical failure of each policy]"
        "(../figures/imitation.png)",
        summary.imitation,
    ),
    Section(
        "results/robustness",
        "Table 5: other cameras, noise, light, colours, mugs",
        (
            "robustness_plain",
            "robustness_plain_beyond",
            "robustness_plain_mugs",
            "robustness_cluttered",
            "robustness_without_variation",
        ),
        "python eval/robustness.py --out eval/results/robustness_plain.json",
        "The hand's camera is turned about its own upright and sideways axes and shifted along all "
        "three, once an episode, or anew for each picture. Light, colours, a distractor and other "
        "mugs are not in the paper. Mugs held out are beyond those of training in radius, height, "
        "handle, mass and colour at once; with recovery a hand that has closed on nothing backs "
        "off and looks again. "
        "`robustness_without_variation` is of weights that saw one camera only in "
        "training. A toggle error needs phases that end in a toggle: where most episodes fail it "
        "says little.\n\n![One scene under each setting, the expert's toggles as discs, predicted "
        "ones as crosses](../figures/robustness.png)",
        summary.robustness,
    ),
    Section(
        "results/expansions",
        "Table 2: normalised RRT expansions",
        ("expansions_plain", "expansions_cluttered", "expansions_ways"),
        "python eval/expansions.py --variant plain",
        "The paper does not say which backbone its counts are from, what happens near the goal, "
        "nor how long the steps of the classical planners are. Here every row of a backbone has "
        "the same steps (0.05 to 0.2 rad), goal tests and budget (N_rrt = 500 a phase), and each "
        "backbone is a table of its own. Trials are episodes that the demonstrations' planner "
        "drove to the expert's subgoals: no learned sampler had a part in posing them. The paper "
        "averages over successful episodes; that hides failures, so failures with the whole budget "
        "stand beside it. A single tree of uniform samples without any goal bias does not find a "
        "goal in 7 dimensions, so the paper's 2.75 must come from another rule: it stands at both "
        "uniform rows. Segments of all samplers say where they begin (`tree_context`), which is "
        "not in the paper; 'ours without tree context' and the backbone 'literal' are. The "
        "samplers' settings were chosen on other seeds (`configs/compact.py`), CVAE and GAN like "
        "ours. A well-tuned CVAE follows the expert's ways nearly as well as the diffusion model; "
        "with more weight on its KL divergence it keeps to their middle and does far worse. "
        "In the plain scene the straight motion of a blocked phase grazes an obstacle, and "
        "any sample beside it lets RRT-Connect pass: there uniform samples do best. In `ways` "
        "N_rrt is 2,000, since the paper takes what is large enough that success has saturated: "
        "with 500 a quarter of the phases past the post stay unsolved. There the CVAE, which "
        "proposes the mean of two ways too, needs more than twice our expansions; the GAN, whose "
        "proposals are the widest, no more than ours. `literal` was not measured there.",
        summary.expansions,
    ),
    Section(
        "results/ways",
        "Which of several ways samplers propose",
        ("proposed_ways",),
        "python eval/ways.py",
        "Not in the paper. In the variant `ways` the mug is carried past a post on either side; an "
        "episode may close one of them by a zone that no camera sees. Demonstrations take the way "
        "that their seed leaves, so that a sampler should hold both. A problem's ways are found by "
        "the demonstrations' planner, the others closed; a proposal belongs to the way whose "
        "closing takes it away.\n\n![Proposals of diffusion, CVAE and conditional GAN on the way "
        "past the post, from above](../figures/figure5_ways.png)",
        summary.ways,
    ),
    Section(
        "results/proposals",
        "Table 3: time of one proposal",
        ("proposal_time",),
        "python eval/proposal_time.py",
        "Batch 1, planner excluded, as in the paper, and beside it what the planner really pays: "
        "segments drawn many at a time.",
        summary.proposals,
    ),
    Section(
        "results/first_solutions",
        "Table 4: time to first solution of an episode",
        (
            "ttfs_plain",
            "ttfs_rrt_plain",
            "ttfs_cluttered",
            "ttfs_rrt_cluttered",
            "ttfs_ways",
        ),
        "python eval/ttfs.py --variant plain",
        "Two CPU cores that other work shared, in place of the paper's unnamed machine; sides "
        "take turns at each phase, so that ratios hold. Segments come in banks, drawn when a "
        "search asks for the first; the paper draws one proposal at a time, whose price is the "
        "column of that name.",
        summary.first_solutions,
    ),
    Section(
        "results/ablations",
        "Ablations",
        ("ablations_plain", "ablations_cluttered"),
        "python eval/ablations.py --variant plain",
        "The paper has T = 10 beside T = 25 and gives no other ablation.",
        None,
    ),
    Section(
        "results/recovery",
        "Recovery after a failed grasp",
        ("success_noisy", "success_noisy_regrasp"),
        "python eval/success.py --seeds 210000:210064 --study.prediction-noise 0.03 "
        "--study.algorithm.regrasp --out eval/results/success_noisy_regrasp.json",
        "Not in the paper. No grasp fails with the shipped weights, so each joint of what the "
        "upper network says gets noise of 0.03 rad here: without recovery and with it.",
        None,
    ),
    Section(
        "results/scene_sampler",
        "Samplers of a scene, on MotionBenchMaker's problems",
        ("scene_sampler",),
        "python eval/scene_sampler.py --out eval/results/scene_sampler.json",
        "Not in the paper. Samplers that are told where obstacles are and see no picture, of the "
        "paper's kind and others, trained on variations of every second problem of each set and "
        "asked the others; half of the proposals stay uniform. The last row of each table is told "
        "of another problem's obstacles. Every path was certified.",
        summary.scene_sampler,
    ),
    Section(
        "results/speed",
        "Speed beside MuJoCo, OMPL, PyBullet and PyTorch",
        ("benchmark", "motion_bench", "motion_bench_fetch"),
        "python eval/benchmark.py --update-baseline",
        "Not in the paper. Both sides of a ratio were measured in one run on one machine.",
        summary.speed,
    ),
    Section(
        "reliability",
        "Reliability: what must not happen, and how often it did",
        ("reliability",),
        "python eval/reliability.py",
        "Not in the paper. Each row is a promise, tried as often as it says, at random but "
        "repeatably; the last column is what was measured of other systems. Quick forms of the "
        "same trials are tests. What a certificate means, and what it does not cover, is on "
        "[a page of its own](guarantee.md).",
        None,
    ),
)
MOST = 3
"""Of what is worse, as said in a section of RESULTS.md."""
NOT_OURS = ("robustness_without_variation",)
"""Files that ours is compared with."""
EARLIER = "weights that were shipped earlier"
FIGURES = {
    "figure2.png": "Figure 2: proposals (blue) on the way to a grasp and to a release.",
    "figure3.png": "Figure 3: one episode.",
    "figure4.png": "Figure 4: three initial poses.",
    "figure5.png": "Figure 5: diffusion, CVAE and conditional GAN side by side.",
}


@dataclass(frozen=True)
class Args(Checked):
    """Writes RESULTS.md and the pages that it leads to."""

    results: Path = RESULTS
    out: Path = ROOT


def main(args: Args) -> None:
    """Writes the pages."""
    for name, text in report(args.results).items():
        path = args.out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(path, text.encode())
        print(f"written to {path}")


def report(results: Path = RESULTS, root: Path = ROOT) -> dict[str, str]:
    """The pages as text, by their path from the repository's root."""
    parts = [
        "# Results\n",
        "Made by `python eval/report.py` from `eval/results/*.json`. A figure in brackets is a "
        "95 % interval. Paper: Lee and Cho, Electronics 2025, 14, 4837. Each page has all tables, "
        "the commands, and what differs from the paper.\n",
    ]
    pages: dict[str, str] = {}
    earlier: list[str] = []
    more: list[str] = []
    for section in SECTIONS:
        found = {
            name: json.loads(path.read_text(encoding="utf-8"))
            for name in section.files
            if (path := results / f"{name}.json").is_file()
        }
        pages[f"docs/{section.page}.md"] = _page(section, found)
        earlier += [name for name in found if _is_earlier(name, found[name])]
        head = f"[{section.title}](docs/{section.page}.md)"
        lines = _worse(found)
        worse = _summed(lines) if lines else ""
        if section.summary is None:
            said = worse if found else _missing(section)
            more.append(f"- {head}. {said}".strip())
            continue
        parts.append(f"## {head}\n")
        parts.append(markdown(section.summary(found)) if found else _missing(section))
        parts += filter(None, [worse])
    if earlier:
        parts[1] += f"\nMeasured with {EARLIER}: {', '.join(earlier)}.\n"
    parts += ["## More\n", "\n".join(more) + "\n"]
    pictures = [
        f"{caption}<br>![{caption.partition(':')[0]}](docs/figures/{name})\n"
        for name, caption in FIGURES.items()
        if (root / "docs" / "figures" / name).is_file()
    ]
    if pictures:
        parts.append("## Figures 2 to 5\n\nMade by `python eval/figures.py`.\n")
        parts += pictures
    return {"RESULTS.md": "\n".join(parts)} | pages


def _page(section: Section, found: Found) -> str:
    """All tables of a section, with the commands that made them."""
    parts = [f"# {section.title}\n\n{section.differs}\n"]
    if worse := _worse(found):
        body = "".join(f"- {line}\n" for line in worse)
        parts.append(f"Worse, or short of the aim:\n\n{body}")
    for name, result in found.items():
        parts += [f"## {name}\n", _origin(name, result)]
        parts += [f"### {_titled(name, t)}\n\n{markdown(t)}" for t in tables(result)]
    if not found:
        parts.append(_missing(section))
    return "\n".join(parts)


def _titled(name: str, table: Table) -> str:
    """A title that no other section has."""
    said = name.replace("_", " ")
    return f"{table.title} ({said})" if table.title else said


def _missing(section: Section) -> str:
    return f"Not measured: `{section.command}`.\n"


def tables(result: dict[str, Any]) -> list[Table]:
    """The tables of any script's JSON."""
    if "tables" in result:
        return [table(content) for content in result["tables"]]
    if "success_rate" in result:
        return _success(result)
    parts = result.get("parts") or {"": result}
    return [_rows(title, part) for title, part in parts.items() if part.get("rows")]


def _success(result: dict[str, Any]) -> list[Table]:
    """Of `eval/success.py`."""
    title = f"{scene(result)}: success over {result['trials']} episodes, toggle error"
    success = rate(result)
    rows: list[list[Any]] = [
        ["success, % (Table 1)", success, PAPER_SUCCESS],
        ["success, % (Table 5, nominal)", success, PAPER_NOMINAL],
    ]
    if toggles := result.get("toggle_error"):
        rows += [
            [
                "toggle error to the nearest [rad]",
                toggles["nearest_toggle_mean"],
                PAPER_ERROR,
            ],
            ["toggle error to the next, mean [rad]", toggles["mean"], None],
            ["toggle error to the next, median [rad]", toggles["median"], None],
        ]
        rows += [
            [f"{name}, median [rad]", row["median"], None]
            for name, row in toggles["per_toggle"].items()
        ]
    return [Table(title, ["", "ours", "paper"], rows)]


def _rows(title: str, part: dict[str, Any]) -> Table:
    """Of the benchmark and its like (`rows.py`)."""
    rows = [
        [
            row["scene"],
            row["side"],
            row["note"] or "-"
            if row["median"] is None
            else _estimate(row["median"], row["p10"], row["p90"]),
            row["unit"],
        ]
        for row in part["rows"]
    ]
    ratios = [
        f"{name}: {ratio['value'] if isinstance(ratio, dict) else ratio:.3g}"
        for name, ratio in part.get("ratios", {}).items()
    ]
    note = "Median, 10th and 90th percentile." + "".join(f"\n- {r}" for r in ratios)
    return Table(title, ["scene", "side", "median", "unit"], rows, note)


def _estimate(median: float, low: float | None, high: float | None) -> str:
    """Three significant digits, whatever the size."""
    if low is None or high is None:
        return f"{median:.3g}"
    return f"{median:.3g} ({low:.3g} to {high:.3g})"


def _origin(name: str, result: dict[str, Any]) -> str:
    """Command, date, machine, and what the run says of itself."""
    versions = result.get("versions", {})
    settings = result.get("settings", {})
    said = [
        f"`{result['command']}`" if result.get("command") else f"`{name}.json`",
        result.get("date", ""),
        versions.get("machine", ""),
        f"jaxplan {versions['jaxplan']}" if "jaxplan" in versions else "",
        "quick run" if result.get("quick") else "",
        EARLIER if _is_earlier(name, result) else "",
    ]
    if "seeds" in settings:
        said.append(f"seeds {settings['seeds']}")
    if "phases" in settings:
        said.append(
            f"{settings['successful_trials']} of {settings['trials']} trials successful, "
            f"{settings['phases']} phases, {100 * settings['blocked_share']:.1f} % of them "
            f"blocked, targets by the {settings['upper']}"
        )
    return "; ".join(filter(None, said)) + "\n"


def _is_earlier(name: str, result: dict[str, Any]) -> bool:
    """Whether it was measured with weights that are shipped no more."""
    used = result.get("weights") or result.get("settings", {}).get("weights") or {}
    checksums = used.values() if isinstance(used, dict) else used
    return name not in NOT_OURS and bool({*checksums} - _shipped())


@cache
def _shipped() -> set[str]:
    """Checksums of all weights that the package and the repository have."""
    places = DIRECTORY, ROOT / "weights"
    manifests = [path for place in places for path in place.glob(f"**/{MANIFEST}")]
    read = [json.loads(path.read_text(encoding="utf-8")) for path in manifests]
    return {entry["sha256"] for manifest in read for entry in manifest.values()}


def _worse(found: Found) -> list[str]:
    """Where ours is worse than the paper or short of its aim, a line each."""
    ours = [result for name, result in found.items() if name not in NOT_OURS]
    lines = [line for result in ours for line in result.get("shortfalls", [])]
    for name in SUCCESS:
        if result := found.get(name):
            success = 100 * result["success_rate"]
            if success < PAPER_SUCCESS:
                lines.append(f"{name}: {success:.1f} % (paper {PAPER_SUCCESS})")
            toggles = result.get("toggle_error") or {}
            if (mean := toggles.get("nearest_toggle_mean", 0)) > PAPER_ERROR:
                lines.append(f"{name}: toggle error {mean:.4f} (paper {PAPER_ERROR})")
    return lines


def _summed(worse: list[str]) -> str:
    """The first `MOST` of what is worse, and how many more there are."""
    more = len(worse) - MOST
    said = [*worse[:MOST], *([f"and {more} more, on its page"] if more > 0 else [])]
    return f"Worse, or short of the aim: {'; '.join(said)}.\n"


if __name__ == "__main__":
    run_script(main, Args)
