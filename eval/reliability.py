"""What must never happen, and how often it did: the figures R1 to R20.

    python eval/reliability.py
    python eval/reliability.py --only R10 R11
    python eval/reliability.py --quick

Each promise of `parts/promises` is tried as often as it says, in pieces that are kept: a killed run
goes on where it was. A fault is a line that says what went wrong. All of them together take
hours; `--quick` tries each a few times.
"""

import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from parts.named import named
from parts.promises import PROMISES, Promise
from tqdm import tqdm

from jaxplan.cli import run_script
from jaxplan.evaluation.memo import Memo, code_digest
from jaxplan.evaluation.recorded_study import results
from jaxplan.evaluation.result import Result
from jaxplan.evaluation.tables import Table
from jaxplan.ranges import Checked

EVERYTHING = (".",)
"""All of the package may break a promise."""


@dataclass(frozen=True)
class Args(Checked):
    """Tries promises, prints a table, writes JSON."""

    only: tuple[str, ...] = ()
    """Numbers, such as R10; all by default."""
    quick: bool = False
    """One piece of each."""
    out: Path | None = None
    """JSON; by default in `eval/results`, of a quick run in `runs`."""


@dataclass
class Tried:
    """How often, and what came of it."""

    times: int
    faults: list[str]


def main(args: Args) -> None:
    """Tries, prints, writes."""
    start = time.perf_counter()
    known = {promise.number: promise for promise in PROMISES}
    chosen = named("only", known, args.only or known)
    memo, tried = Memo(), {}
    with TemporaryDirectory() as work:
        for promise in chosen:
            place = Path(work) / promise.number
            place.mkdir()
            tried[promise] = attempt(promise, place, memo, args.quick)
            for fault in tried[promise].faults[:5]:
                print(f"{promise.number}: {fault}")
    result = Result(
        [table(tried)],
        {},
        [
            f"{promise.number}: {len(found.faults)} of {found.times}: {found.faults[0]}"
            for promise, found in tried.items()
            if found.faults
        ],
        args.quick,
        time.perf_counter() - start,
    )
    result.show()
    out = args.out or results(args.quick) / "reliability.json"
    result.write(out)
    print(f"written to {out}")


def attempt(promise: Promise, place: Path, memo: Memo, quick: bool) -> Tried:
    """A promise as often as it says, what was tried before left out."""
    count = min(promise.count, promise.piece) if quick else promise.count
    code, faults, trial = code_digest(EVERYTHING), [], None
    bar = tqdm(total=count, desc=promise.number, unit="trial")
    for first in range(0, count, promise.piece):
        numbers = range(first, min(first + promise.piece, count))

        def make(numbers: range = numbers) -> list[str]:
            nonlocal trial
            trial = trial or promise.prepare(place)
            return trial(numbers)

        key = {"promise": promise.number, "what": promise.what, "code": code}
        faults += memo(key | {"numbers": [numbers.start, numbers.stop]}, make)
        bar.update(len(numbers))
    bar.close()
    return Tried(count, faults)


def table(tried: dict[Promise, Tried]) -> Table:
    """A row a promise."""
    rows = [
        [promise.number, promise.what, found.times, len(found.faults), promise.peers]
        for promise, found in tried.items()
    ]
    columns = ["", "what must not happen", "tried", "happened", "peers, as measured"]
    return Table("What must not happen", columns, rows)


if __name__ == "__main__":
    run_script(main, Args)
