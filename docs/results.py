"""Fills `{{ results }}` from `eval/results/*.json`; called by mkdocs."""

import json
from pathlib import Path
from typing import Any

RESULTS = Path(__file__).parents[1] / "eval" / "results"
MARK = "{{ results }}"


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The page with the tables in place of the mark."""
    return markdown.replace(MARK, tables()) if MARK in markdown else markdown


def tables(directory: Path = RESULTS) -> str:
    """A section a file, a table a part."""
    files = sorted(directory.glob("*.json"))
    sections = [section(file.stem, json.loads(file.read_text())) for file in files]
    return "\n".join(sections) or "No result is committed yet."


def section(name: str, result: dict[str, Any]) -> str:
    """A file's rows by part, and where they come from."""
    lines = [f"## {name}", ""]
    for title, part in result.get("parts", {}).items():
        lines += [
            f"### {title}",
            "",
            "| scene | side | median | unit |",
            "|---|---|---|---|",
        ]
        for row in part.get("rows", []):
            median = row.get("median")
            shown = row.get("note") or "-" if median is None else f"{median:.4g}"
            unit = row.get("unit", "")
            lines.append(f"| {row['scene']} | {row['side']} | {shown} | {unit} |")
        lines.append("")
        if ratios := part.get("ratios"):
            lines += ["| ratio | value |", "|---|---|"]
            for what, ratio in ratios.items():
                value = ratio["value"] if isinstance(ratio, dict) else ratio
                value = value[0] if isinstance(value, list) else value
                lines.append(f"| {what} | {value:.3g} |")
            lines.append("")
    versions = result.get("versions", {})
    lines.append("; ".join(f"{what} {version}" for what, version in versions.items()))
    return "\n".join([*lines, ""])
