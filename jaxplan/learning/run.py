"""A run's directory: claimed by one process, for one set of settings, with a log of its metrics."""

import dataclasses
import json
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

from filelock import FileLock, Timeout
from tqdm import tqdm

from jaxplan.data import write_atomic
from jaxplan.learning import checkpoint

Metrics = dict[str, float]


class RunError(ValueError):
    """The run's directory belongs to another run, or its settings cannot be met."""


@contextmanager
def claimed(run: Path, config: Any, origin: Mapping[str, Any]) -> Iterator[Path]:
    """A run of one's own: nobody else trains there, with these settings of this origin.

    Args:
        run: Its directory.
        config: Settings, a dataclass.
        origin: Checksums of all that the weights come from, beside the settings.

    Returns:
        Where its checkpoints are.

    Raises:
        RunError: It was begun with other settings or of another origin, or another process
            trains there.
    """
    run.mkdir(parents=True, exist_ok=True)
    store = run / "checkpoints"
    try:
        with FileLock(run / ".lock", blocking=False):
            _claim(run / "config.json", store, config, origin)
            yield store
    except Timeout:
        raise RunError(
            f"another process trains in {run}: choose another --name"
        ) from None


class Progress:
    """What a run says of itself: lines of `metrics.jsonl`, and a bar.

    Args:
        path: Of the lines; those that steps after `first` wrote before a kill are dropped.
        name: The run's.
        first: Step that it goes on from.
        steps: It ends after.
        batch_size: Examples of a step.
    """

    def __init__(
        self, path: Path, name: str, first: int, steps: int, batch_size: int
    ) -> None:
        _forget_after(path, first)
        self._log = path.open("a")
        self._bar = tqdm(total=steps, initial=first, desc=name, unit="step")
        self._first, self._batch_size = first, batch_size
        self._began = time.perf_counter()

    def __enter__(self) -> "Progress":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.close()
        self._log.close()

    def trained(self, step: int, metrics: Metrics) -> None:
        """Of the examples of a step."""
        examples = (step - self._first) * self._batch_size
        rate = examples / (time.perf_counter() - self._began)
        self._write({"step": step, **metrics, "examples_per_second": rate})
        self._bar.update(step - self._bar.n)
        words = f"loss {metrics['loss']:.2e}, {rate:.0f} examples/s"
        self._bar.set_postfix_str(words, refresh=False)

    def validated(self, step: int, metrics: Metrics) -> None:
        """Of what was held out."""
        self._write({"step": step, **{f"val_{k}": v for k, v in metrics.items()}})

    def _write(self, values: dict) -> None:
        self._log.write(json.dumps(values) + "\n")
        self._log.flush()


def _claim(path: Path, store: Path, config: Any, origin: Mapping[str, Any]) -> None:
    """Writes `config.json`, or checks that it holds the same settings and origin."""
    wanted = json.loads(json.dumps(dataclasses.asdict(config) | dict(origin)))
    if path.exists() and checkpoint.latest(store) is not None:
        found = json.loads(path.read_text())
        # Where the weights go does not change what they are.
        changed = [k for k in wanted if found.get(k) != wanted[k] and k != "out"]
        if changed:
            raise RunError(
                f"{path.parent} was begun with another {', '.join(changed)}: "
                "choose another --name, or delete it"
            )
    write_atomic(path, (json.dumps(wanted, indent=2) + "\n").encode())


def _forget_after(path: Path, step: int) -> None:
    """Drops the lines of later steps."""
    if not path.exists():
        return
    kept = []
    for line in path.read_text().splitlines(keepends=True):
        try:
            if json.loads(line)["step"] <= step:
                kept.append(line)
        except ValueError:  # half a line
            break
    write_atomic(path, "".join(kept).encode())
