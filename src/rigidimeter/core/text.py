"""How a number with its error, a line and a small table are written for people."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape

_PLAIN = (0.01, 1e5)
"""Numbers of this size are written without a power of ten."""


def with_error(value: float, standard_error: float) -> str:
    """Return a number ± its standard error: two digits of the error, the number to the same place.

    A number without an error has four digits, one that is NaN is a dash.

    Examples
    --------
    >>> with_error(0.136801, 8.7e-05), with_error(-1.7031, 0.0996), with_error(12345.6, 234.0)
    ('0.136801 ± 0.000087', '−1.70 ± 0.10', '12350 ± 230')
    >>> with_error(0.004588, 8.1e-06), with_error(1.7, math.nan), with_error(math.nan, math.nan)
    ('4.5880e-3 ± 0.0081e-3', '1.7', '–')
    """
    value, standard_error = float(value), float(standard_error)
    if math.isnan(value):
        return "–"
    if not standard_error > 0:
        shown = f"{value:.4g}"
    elif not 1e-9 * abs(value) < standard_error < math.inf:
        shown = f"{value:.4g} ± {standard_error:.2g}"
    else:
        size = max(abs(value), standard_error)
        power = 0 if _PLAIN[0] <= size < _PLAIN[1] else 3 * math.floor(math.log10(size) / 3)
        number, error = value / 10.0**power, standard_error / 10.0**power
        place = int(f"{error:.1e}".partition("e")[2]) - 1  # of the last of the two digits
        rounded = (round(one, -place) + 0.0 for one in (number, error))
        times = f"e{power}" if power else ""
        shown = " ± ".join(f"{one:.{max(-place, 0)}f}{times}" for one in rounded)
    return f"−{shown[1:]}" if shown.startswith("-") else shown


def one_line(*parts: str, joint: str = "; ") -> str:
    r"""Return the parts that say something as one line, whatever names from files hold.

    Examples
    --------
    >>> one_line("2 epochs", "", "of day\n1")
    '2 epochs; of day 1'
    """
    line = " ".join(joint.join(part for part in parts if part).split())
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in line)


def html_table(heading: Iterable[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table for a notebook, which needs no style to be read."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heading)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
