"""How a number with its error, a line and a small table are written for people."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import PurePath

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
        power = _power_of_ten(value)
        return _minus(f"{value / 10.0**power:.4g}{f'e{power}' * bool(power)}")
    if not 1e-9 * abs(value) < standard_error < math.inf:
        return _minus(f"{value:.4g} ± {standard_error:.2g}")
    return " ± ".join(_to_the_error((value, standard_error), standard_error))


def interval_text(low: float, high: float) -> str:
    """Return a 95 % interval to the place of its standard error, a dash where there is none.

    Examples
    --------
    >>> interval_text(1.6704, 1.7372), interval_text(-0.0005, 0.0041), interval_text(math.nan, 1.0)
    ('1.670 to 1.737', '−0.5e-3 to 4.1e-3', '–')
    """
    if not -math.inf < low < high < math.inf:
        return "–"
    return " to ".join(_to_the_error((low, high), (high - low) / 4))


def _to_the_error(numbers: Sequence[float], error: float) -> Iterable[str]:
    """Return numbers with one power of ten, to the place of the second digit of an error."""
    power = _power_of_ten(max(map(abs, numbers)))
    place = int(f"{error / 10.0**power:.1e}".partition("e")[2]) - 1
    times = f"e{power}" if power else ""
    rounded = (round(one / 10.0**power, -place) + 0.0 for one in numbers)
    return (_minus(f"{one:.{max(-place, 0)}f}{times}") for one in rounded)


def _power_of_ten(number: float) -> int:
    size = abs(number)
    plain = not size or math.isinf(size) or _PLAIN[0] <= size < _PLAIN[1]
    return 0 if plain else 3 * math.floor(math.log10(size) / 3)


def _minus(text: str) -> str:
    return f"−{text[1:]}" if text.startswith("-") else text


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
