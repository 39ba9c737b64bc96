"""Numbers and epochs in sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence

LEAST_P = 1e-6

MOST_RANGES = 6
"""At most so many ranges of epochs are named."""


def p_text(p: float) -> str:
    """Return a probability as text, a small one as a limit: no assumption is as good as that."""
    return f"p = {p:.2g}" if p >= LEAST_P else f"p < {LEAST_P:g}"


def in_full(value: float, spec: str = ".2g", *, limit: float = math.nan) -> str:
    """Return a number rounded as `spec` says, without a power of ten for a large one.

    With more digits where it would read as the limit that is shown beside it, and is not.

    Examples
    --------
    >>> in_full(104.2), in_full(7.36), in_full(-290.0, "+.2g"), in_full(2e-9)
    ('104', '7.4', '-290', '2e-09')
    >>> in_full(15.2, limit=15.0), in_full(99.98, ".0f", limit=100.0), in_full(15.0, limit=15.0)
    ('15.2', '99.98', '15')
    """
    text = format(value, spec)
    for digits in range(3, 18):  # 17 tell any two numbers apart
        if value == limit or not math.isclose(float(text), limit, rel_tol=1e-14):
            break
        text = format(value, f".{digits}g")
    whole = "e+" in text and abs(value) < 1e6
    return format(value, f"{'+' if '+' in spec else ''}.0f") if whole else text


class Shown(float):
    """A number that a template rounds, by `in_full`."""

    limit: float = math.nan

    def __format__(self, spec: str) -> str:
        """Return it rounded as `spec` says."""
        text = in_full(float(self), spec or ".3g", limit=self.limit)
        return text if "e" in text else text.replace("-", "−")


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
        f"{one[0]}–{one[-1]}" if len(one) > 2 else ", ".join(one) for one in ranges[:MOST_RANGES]
    ]
    more = sum(map(len, ranges[MOST_RANGES:]))
    return (
        f"epoch{'s' if len(labels) > 1 else ''} {', '.join(parts)}"
        f"{f' and {more} more' if more else ''}"
    )
