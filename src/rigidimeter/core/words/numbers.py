"""Numbers and names as people read them. What is stored keeps every digit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

SMALLEST_P = 1e-300
"""Below this a p-value has run out of floating point."""


def number(value: float, digits: int = 4) -> str:
    """Return a number with so many significant digits, a dash for NaN.

    Examples
    --------
    >>> number(0.1368), number(12345.6), number(-2.0), number(1.2e-7)
    ('0.1368', '12346', '−2.000', '1.200e-07')
    """
    if math.isnan(value):
        return "–"
    sign = "−" if value < 0 else ""
    size = abs(value)
    if math.isinf(size):
        return f"{sign}∞"
    if size == 0:
        return "0"
    scientific = f"{size:.{digits - 1}e}"
    exponent = int(scientific.partition("e")[2])
    if not -4 <= exponent < 6:
        return sign + scientific
    return f"{sign}{size:.{max(digits - 1 - exponent, 0)}f}"


def scaled(size: float, unit: str) -> tuple[float, str]:
    """Return the factor and the unit in which a number of this size is written without zeros.

    Examples
    --------
    >>> scaled(0.0045, "kg·m²"), scaled(1.7, "N·m/rad")
    ((1000.0, '10⁻³ kg·m²'), (1.0, 'N·m/rad'))
    """
    if unit and 0 < abs(size) < 0.01:
        return 1e3, f"10⁻³ {unit}"
    return 1.0, unit


def axis_unit(sizes: Iterable[float], unit: str) -> tuple[float, str]:
    """Return the factor and the unit of an axis that holds these numbers.

    Examples
    --------
    >>> axis_unit([0.0045, -0.0041], "kg·m²")
    (1000.0, '10⁻³ kg·m²')
    """
    return scaled(max((abs(size) for size in sizes if math.isfinite(size)), default=0.0), unit)


def amount(value: float, unit: str, digits: int = 4) -> str:
    """Return a number with its unit, scaled, unbroken between the two.

    Examples
    --------
    >>> amount(0.00451, "kg·m²", 3).replace("\N{NO-BREAK SPACE}", " ")
    '4.51·10⁻³ kg·m²'
    """
    factor, in_unit = scaled(value, unit)
    joint = "·" if factor != 1 else "\N{NO-BREAK SPACE}"
    text = f"{number(factor * value, digits)}{joint}{in_unit}" if unit else number(value, digits)
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def interval(low: float, high: float, digits: int = 4) -> str:
    """Return an interval as the page writes it.

    Examples
    --------
    >>> interval(-0.5, 12.0, 3)
    '[−0.500 to 12.0]'
    """
    return f"[{number(low, digits)} to {number(high, digits)}]"


def p_value(p: float, digits: int = 3) -> str:
    """Return a p-value, never as zero.

    Examples
    --------
    >>> p_value(0.0004), p_value(1.234e-6), p_value(0.0496), p_value(0.0), p_value(0.0336, 2)
    ('0.0004', '1.2e-06', '0.0496', '< 1e-300', '0.034')
    """
    if math.isnan(p):
        return "–"
    if p < SMALLEST_P:
        return f"< {SMALLEST_P:.0e}"
    return f"{p:.{digits}g}" if p >= 1e-4 else f"{p:.1e}"


def p_and_r(p: float, r: float) -> str:
    """Return p and effect size as sentences quote them, unbroken at the signs.

    Examples
    --------
    >>> p_and_r(0.0004, -0.351).replace("\N{NO-BREAK SPACE}", " ")
    'p = 0.0004, r = −0.35'
    """
    text = f"p = {p_value(p)}, r = {r:.2f}".replace("= <", "<").replace("= -", "= −")
    return text.replace(" =", "\N{NO-BREAK SPACE}=").replace("= ", "=\N{NO-BREAK SPACE}")


def series(items: Sequence[str]) -> str:
    """Return ``a``, ``a and b`` or ``a, b and c``."""
    return " and ".join([", ".join(items[:-1]), items[-1]] if len(items) > 1 else items)


def within(title: str) -> str:
    """Return a title as it is written within a sentence.

    Examples
    --------
    >>> within("Stiffness K"), within("K differs")
    ('stiffness K', 'K differs')
    """
    return title[:1].lower() + title[1:] if title[1:2].islower() else title


def condition_name(condition: str) -> str:
    """Return the condition as people read it."""
    return condition or "(no condition)"


def decimals(half: float, value: float, two_below: float = 5.0) -> int:
    """Return to how many decimals a value is written whose interval has this half-width.

    The half-width has two digits if its first is below `two_below`, else one; where there is none
    the value has two.

    Examples
    --------
    >>> decimals(0.1, 26.0), decimals(8.0, 18.0), decimals(0.38, -0.083), decimals(math.nan, 17.8)
    (2, 0, 2, 0)
    """
    size, below = (half, two_below) if 0 < half < math.inf else (abs(value), 10.0)
    if not 0 < size < math.inf:
        return 0
    power = math.floor(math.log10(size))
    return max((size < below * 10.0**power) - power, 0)


def fixed(value: float, places: int, *, sign: bool = False) -> str:
    """Return a number with so many decimals, with its sign if asked for; zero has none.

    Examples
    --------
    >>> fixed(-0.17, 2), fixed(3.0, 0, sign=True), fixed(-0.001, 1, sign=True)
    ('−0.17', '+3', '0.0')
    """
    text = f"{value:{'+' if sign else ''}.{places}f}"
    return (text if float(text) else text.lstrip("+-")).replace("-", "−")
