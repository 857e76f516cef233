"""Puts RESULTS.md in place of `{{ results }}`; called by mkdocs."""

from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parents[1] / "RESULTS.md"
MARK = "{{ results }}"


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The page with the results in place of the mark, pictures as seen from `docs/`."""
    if MARK not in markdown:
        return markdown
    _, results = RESULTS.read_text(encoding="utf-8").split("\n", 1)
    return markdown.replace(MARK, results.replace("](docs/", "]("))
