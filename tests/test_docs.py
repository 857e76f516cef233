"""What the documents say runs: their Python blocks, in order."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize(
    ("document", "directory"),
    [("README.md", "."), ("docs/index.md", "docs"), ("docs/tutorial.md", "docs")],
)
def test_python_blocks_run(document, directory, monkeypatch):
    monkeypatch.chdir(ROOT / directory)
    text = (ROOT / document).read_text(encoding="utf-8")
    names = {"__name__": document}
    blocks = list(re.finditer(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL))
    assert blocks
    for block in blocks:
        # Empty lines before the block, so that a traceback has the document's numbers.
        before = "\n" * (text[: block.start()].count("\n") + 1)
        exec(compile(before + block[1], document, "exec"), names)


def test_the_results_page_takes_what_the_benchmark_writes(tmp_path):
    spec = importlib.util.spec_from_file_location(
        "results", ROOT / "docs" / "results.py"
    )
    results = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(results)
    row = {"part": "collision", "scene": "mug", "side": "jaxplan", "unit": "1/s"}
    rows = [
        row | {"median": 1.25e6},
        row | {"side": "peer", "median": None, "note": "absent"},
    ]
    ratios = {
        "mug: jaxplan / MuJoCo": {"value": 5.8, "least": 0.5, "against": "MuJoCo"}
    }
    result = {
        "parts": {"collision": {"rows": rows, "ratios": ratios, "counts": {}}},
        "versions": {"jax": "0.10.2"},
    }
    assert "No result" in results.tables(tmp_path)
    (tmp_path / "benchmark.json").write_text(json.dumps(result))
    page = results.on_page_markdown("x {{ results }}").replace("x ", "")
    assert "{{" not in page
    page = results.tables(tmp_path)
    for line in (
        "## benchmark",
        "| mug | jaxplan | 1.25e+06 | 1/s |",
        "| mug | peer | absent | 1/s |",
        "| mug: jaxplan / MuJoCo | 5.8 |",
        "jax 0.10.2",
    ):
        assert line in page.splitlines()
