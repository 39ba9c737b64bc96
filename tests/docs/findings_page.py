"""The table of findings in the page on diagnostics, from the kinds of findings.

`python -m tests.docs.findings_page` writes it anew.
"""

from __future__ import annotations

from pathlib import Path

from rigidimeter.core.findings import KINDS, Kind, explained

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "diagnostics.md"
HEAD = "| finding | what is looked at | key | level | remedy |\n| --- | --- | --- | --- | --- |\n"


def table() -> str:
    """Return the table; the remedies are those of the examples."""
    return HEAD + "".join(_row(kind) for kind in KINDS.values())


def _row(kind: Kind) -> str:
    key = f"`{kind.setting}`" if kind.setting else "–"
    remedy = explained(kind)[0][1].remedy
    return f"| `{kind.name}` | {kind.checks} | {key} | {kind.level} | {remedy} |\n"


def with_table(page: str) -> str:
    """Return the page with the table in the place of the one that it has."""
    before, rest = page.split(HEAD)
    return before + table() + rest[rest.index("\n\n") + 1 :]


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text("utf-8")), "utf-8")
