"""How names, a line and a small table are written for people."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import PurePath

MAX_RANGES = 6
"""At most so many ranges of epochs are named."""


def epochs_text(labels: Sequence[str]) -> str:
    """Return labels of epochs as text, those that follow each other as a range.

    Examples
    --------
    >>> epochs_text(["1", "2", "3", "4", "7"]), epochs_text(["3"]), epochs_text(["a", "b"])
    ('epochs 1–4, 7', 'epoch 3', 'epochs a, b')
    """
    ranges: list[list[str]] = []
    for label in labels:
        last = ranges[-1][-1] if ranges else ""
        if label.isdecimal() and last.isdecimal() and int(label) == int(last) + 1:
            ranges[-1].append(label)
        else:
            ranges.append([label])
    parts = [
        f"{one[0]}–{one[-1]}" if len(one) > 2 else ", ".join(one) for one in ranges[:MAX_RANGES]
    ]
    more = sum(map(len, ranges[MAX_RANGES:]))
    return (
        f"epoch{'s' if len(labels) > 1 else ''} {', '.join(parts)}"
        f"{f' and {more} more' if more else ''}"
    )


def epoch_name(label: str, source: str, names: Mapping[str, str]) -> str:
    """Return what an epoch is called: with its source where there are several, which share labels.

    Examples
    --------
    >>> epoch_name("3", "/data/day-1", {"/data/day-1": "day-1", "/data/day-2": "day-2"})
    'epoch 3 of day-1'
    >>> epoch_name("3", "/data/day-1", {"/data/day-1": "day-1"})
    'epoch 3'
    """
    return f"epoch {label}" + (f" of {names.get(source, source)}" if len(names) > 1 else "")


def plural(count: int, noun: str) -> str:
    """Return ``1 epoch`` or ``2 epochs``."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def one_line(*parts: str, joint: str = "; ") -> str:
    r"""Return the parts that say something as one line, whatever names from files hold.

    Examples
    --------
    >>> one_line("2 epochs", "", "of day\n1")
    '2 epochs; of day 1'
    """
    line = " ".join(joint.join(part for part in parts if part).split())
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in line)


def short_names(sources: Iterable[str]) -> dict[str, str]:
    """Return the last parts of each path: as few as keep the sources apart."""
    unique = list(dict.fromkeys(sources))
    parts = {source: PurePath(source).parts for source in unique}
    for depth in range(1, max(map(len, parts.values()), default=1) + 1):
        names = {source: "/".join(parts[source][-depth:]) or source for source in unique}
        if len(set(names.values())) == len(unique):
            return names
    return {source: source for source in unique}


def one_cell(number: str) -> str:
    """Return a number of several parts for a cell of a table that does not break it."""
    return number.replace(" ", "\N{NO-BREAK SPACE}")


def html_table(heading: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table for a notebook, which needs no style to be read."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heading)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
