"""The table of findings, from their kinds."""

from __future__ import annotations

from rigidimeter.core.findings import KINDS, Kind, explained

HEAD = "| finding | what is looked at | key | level | remedy |\n| --- | --- | --- | --- | --- |\n"


def findings_table() -> str:
    """Return the table; the remedies are those of the examples."""
    return HEAD + "".join(_row(kind) for kind in KINDS.values())


def _row(kind: Kind) -> str:
    key = f"`{kind.setting}`" if kind.setting else "–"
    remedy = explained(kind)[0][1].remedy
    return f"| `{kind.name}` | {kind.checks} | {key} | {kind.level} | {remedy} |\n"
