"""A value and its interval on a small axis, as SVG that is part of the page, text as text."""

from __future__ import annotations

import math

from markupsafe import Markup

_WIDTH, _HEIGHT, _AXIS, _PAD = 190, 38, 14, 12
_STEPS = (1, 2, 5)
MOST_PERCENT = 100.0
"""An axis in per cent reaches at most so far; what is beyond it is drawn as an arrow."""


def reach(sizes: list[float], most: float = math.inf) -> float:
    """Return the end of an axis that holds these sizes: 1, 2 or 5 times a power of ten.

    Examples
    --------
    >>> reach([3.1, 17.0]), reach([0.31]), reach([260.0], most=100.0), reach([])
    (20.0, 0.5, 100.0, 1.0)
    """
    largest = max((abs(size) for size in sizes if math.isfinite(size)), default=0.0)
    if not largest:
        return min(1.0, most)
    power = 10.0 ** math.floor(math.log10(largest))
    end = next((k * power for k in _STEPS if k * power >= largest), 10 * power)
    return min(end, most)


def interval_plot(
    value: float,
    ends: tuple[float, float],
    axis: tuple[str, str, str],
    to: float,
    *,
    kind: str = "",
    band: float = 0.0,
    words: str = "",
) -> Markup:
    """Draw a value with its interval; zero is in the middle of the axis.

    Parameters
    ----------
    value : float
        Nothing but the axis is drawn for NaN.
    ends : (float, float)
        Of the interval; none is drawn for NaN.
    axis : (str, str, str)
        What is written below the left end, zero, and the right end.
    to : float
        The axis goes from −`to` to `to`.
    kind : str
        A class of the page's style: ``shown``, ``unsupported`` or nothing.
    band : float
        The half width of a shaded band around zero.
    words : str
        What the drawing shows, for those who cannot see it.
    """

    def x(at: float) -> float:
        inside = min(max(at / to, -1.0), 1.0)
        return round(_WIDTH / 2 + inside * (_WIDTH / 2 - _PAD), 1)

    left, right = (x(end) for end in (-to, to))
    parts = [
        Markup(
            '<svg class="interval {}" role="img" aria-label="{}" viewBox="0 0 {} {}" '
            'width="{}" height="{}">'
        ).format(kind, words, _WIDTH, _HEIGHT, _WIDTH, _HEIGHT)
    ]
    if band:
        width = round(x(min(band, to)) - x(-min(band, to)), 1)
        parts.append(
            Markup('<rect class="wanted" x="{}" y="3" width="{}" height="{}"/>').format(
                x(-min(band, to)), width, 2 * (_AXIS - 3)
            )
        )
    parts.append(
        Markup(
            '<path class="axis" d="M{0} {1}H{2}M{0} {3}v4M{4} 3v22M{2} {3}v4" fill="none"/>'
        ).format(left, _AXIS, right, _AXIS - 2, x(0.0))
    )
    low, high = sorted(ends) if all(map(math.isfinite, ends)) else (math.nan, math.nan)
    if math.isfinite(low):
        parts.append(
            Markup('<path class="range" d="M{} {}H{}" fill="none"/>').format(x(low), _AXIS, x(high))
        )
        for end, side in ((low, -1), (high, 1)):
            parts.append(_end(x(end), side, beyond=abs(end) > to * 1.0000001))
    if math.isfinite(value) and abs(value) <= to:
        parts.append(
            Markup('<rect class="value" x="{}" y="{}" width="8" height="8"/>').format(
                x(value) - 4, _AXIS - 4
            )
        )
    for at, anchor, text in ((0, "start", axis[0]), (_WIDTH / 2, "middle", axis[1]),
                             (_WIDTH, "end", axis[2])):  # fmt: skip
        parts.append(
            Markup('<text x="{}" y="{}" text-anchor="{}">{}</text>').format(
                at, _HEIGHT - 2, anchor, text
            )
        )
    return Markup("").join([*parts, Markup("</svg>")])


def _end(at: float, side: int, *, beyond: bool) -> Markup:
    if beyond:
        return Markup('<path class="arrow" d="M{} {}l{} -5v10z"/>').format(
            at + 7 * side, _AXIS, -7 * side
        )
    return Markup('<path class="range" d="M{} {}v8" fill="none"/>').format(at, _AXIS - 4)
