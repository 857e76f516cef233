"""What the documents say runs: their Python blocks, in order."""

import importlib.util
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


def test_the_results_page_is_results_md(tmp_path):
    spec = importlib.util.spec_from_file_location(
        "results", ROOT / "docs" / "results.py"
    )
    assert spec is not None
    assert spec.loader is not None
    results = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(results)
    results.RESULTS = tmp_path / "RESULTS.md"
    results.RESULTS.write_text("# Results\n\n| a |\n\n![b](docs/figures/b.png)\n")
    assert results.on_page_markdown("no mark") == "no mark"
    page = results.on_page_markdown("# Page\n\n{{ results }}\n")
    assert page == "# Page\n\n\n| a |\n\n![b](figures/b.png)\n\n"
