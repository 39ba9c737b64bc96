"""Numbers and names as people read them. What is stored keeps every digit."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from itertools import pairwise

SMALLEST_P = 1e-300
"""Below this a p-value has run out of floating point."""

_PLAIN = (0.01, 1e5)
"""Numbers of this size with their errors are written without a power of ten."""
_PLAIN_TICKS = (1e-4, 1e5)
"""The same of the numbers along an axis."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float, digits: int = 4) -> str:
    """Return a number with so many significant digits, a dash for NaN.

    Examples
    --------
    >>> number(0.1368), number(12345.6), number(-2.0), number(1.2e-7)
    ('0.1368', '12346', '−2.000', '1.200·10⁻⁷')
    """
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "−∞" if value < 0 else "∞"
    if value == 0:
        return "0"
    scientific = f"{value:.{digits - 1}e}"
    power = int(scientific.partition("e")[2])
    if not -4 <= power < 6:
        return _written(scientific)
    return _written(f"{value:.{max(digits - 1 - power, 0)}f}")


def times_ten(power: int) -> str:
    """Return the power of ten that follows a number, nothing for 10⁰.

    Examples
    --------
    >>> times_ten(-3), times_ten(12), times_ten(0)
    ('·10⁻³', '·10¹²', '')
    """
    return f"·10{str(power).translate(_RAISED)}" if power else ""


def _written(text: str) -> str:
    """Return a number of Python's as people write it."""
    mantissa, _, power = text.partition("e")
    return f"{mantissa.replace('-', '−')}{times_ten(int(power or 0))}"


def tick_labels(values: Sequence[float], *, logarithmic: bool = False) -> list[str]:
    """Return the numbers along an axis: all to one place, on a logarithmic one each by itself.

    Examples
    --------
    >>> tick_labels([-0.5, 0.0, 0.5]), tick_labels([0.0, 2e-6]), tick_labels([10.0, 20.0])
    (['−0.5', '0.0', '0.5'], ['0', '2·10⁻⁶'], ['10', '20'])
    >>> tick_labels([1e-8, 2e-5, 0.01, 5.0, 100.0], logarithmic=True)
    ['10⁻⁸', '2·10⁻⁵', '0.01', '5', '100']
    """
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    if logarithmic or not largest:
        return [_alone(value, least=1e-3) for value in values]
    power = 0 if _PLAIN_TICKS[0] <= largest < _PLAIN_TICKS[1] else math.floor(math.log10(largest))
    along = [value / 10.0**power for value in values]
    step = min((b - a for a, b in pairwise(sorted(along)) if b > a), default=1.0)
    places = next(n for n in range(18) if all(abs(v - round(v, n)) < 1e-3 * step for v in along))
    return [
        fixed(value, places) + times_ten(power) if value or not power else "0" for value in along
    ]


def _alone(value: float, least: float = _PLAIN_TICKS[0]) -> str:
    """Return a round number with no more digits than it has."""
    if not math.isfinite(value) or not value or least <= abs(value) < _PLAIN_TICKS[1]:
        return _written(f"{value:.6g}")
    text = _written(re.sub(r"\.?0*e", "e", f"{value:.5e}"))
    return re.sub(r"^(−?)1·", r"\1", text)


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
    ('0.0004', '1.2·10⁻⁶', '0.0496', '< 10⁻³⁰⁰', '0.034')
    """
    if math.isnan(p):
        return "–"
    if p < SMALLEST_P:
        return f"< {_alone(SMALLEST_P)}"
    return f"{p:.{digits}g}" if p >= 1e-4 else number(p, 2)


def p_text(p: float, least: float = 1e-6) -> str:
    """Return a p-value in a sentence, a small one as a limit: no assumption is as good as that.

    Examples
    --------
    >>> p_text(0.0213), p_text(1e-9), p_text(2e-5, 1e-4)
    ('p = 0.021', 'p < 10⁻⁶', 'p < 0.0001')
    """
    return f"p = {p_value(p, 2)}" if p >= least else f"p < {_alone(least)}"


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


def clear_of_zero(places: int, *ends: float) -> int:
    """Return decimals with which no end of an interval is rounded to zero, two more at most.

    Examples
    --------
    >>> clear_of_zero(0, -31.06, -0.13), clear_of_zero(0, -20.0, 3.0), clear_of_zero(1, 0.0, 2.0)
    (1, 0, 1)
    """
    for more in range(2):
        if all(round(end, places + more) or not end for end in ends if math.isfinite(end)):
            return places + more
    return places + 2


def fixed(value: float, places: int, *, sign: bool = False) -> str:
    """Return a number with so many decimals, with its sign if asked for; zero has none.

    Examples
    --------
    >>> fixed(-0.17, 2), fixed(3.0, 0, sign=True), fixed(-0.001, 1, sign=True)
    ('−0.17', '+3', '0.0')
    """
    text = f"{value:{'+' if sign else ''}.{places}f}"
    return (text if float(text) else text.lstrip("+-")).replace("-", "−")


def with_error(value: float, standard_error: float) -> str:
    """Return a number ± its standard error: two digits of the error, the number to the same place.

    A number without an error has four digits, one that is NaN is a dash.

    Examples
    --------
    >>> with_error(0.136801, 8.7e-05), with_error(-1.7031, 0.0996), with_error(12345.6, 234.0)
    ('0.136801 ± 0.000087', '−1.70 ± 0.10', '12350 ± 230')
    >>> with_error(0.004588, 8.1e-06), with_error(1.7, math.nan), with_error(math.nan, math.nan)
    ('(4.5880 ± 0.0081)·10⁻³', '1.7', '–')
    """
    value, standard_error = float(value), float(standard_error)
    if math.isnan(value):
        return "–"
    if not standard_error > 0:
        power = _power_of_ten(value)
        return f"{_written(f'{value / 10.0**power:.4g}')}{times_ten(power)}"
    if not 1e-9 * abs(value) < standard_error < math.inf:
        return f"{_written(f'{value:.4g}')} ± {_written(f'{standard_error:.2g}')}"
    return _to_the_error((value, standard_error), standard_error, " ± ")


def interval_text(low: float, high: float) -> str:
    """Return a 95 % interval to the place of its standard error, a dash where there is none.

    Examples
    --------
    >>> interval_text(1.6704, 1.7372), interval_text(-0.0005, 0.0041), interval_text(math.nan, 1.0)
    ('1.670 to 1.737', '(−0.5 to 4.1)·10⁻³', '–')
    """
    if not -math.inf < low < high < math.inf:
        return "–"
    return _to_the_error((low, high), (high - low) / 4, " to ")


def _to_the_error(numbers: Sequence[float], error: float, joint: str) -> str:
    """Return numbers with one power of ten, to the place of the second digit of an error."""
    power = _power_of_ten(max(map(abs, numbers)))
    place = int(f"{error / 10.0**power:.1e}".partition("e")[2]) - 1
    rounded = (round(one / 10.0**power, -place) + 0.0 for one in numbers)
    text = joint.join(_written(f"{one:.{max(-place, 0)}f}") for one in rounded)
    return f"({text}){times_ten(power)}" if power else text


def _power_of_ten(number: float) -> int:
    size = abs(number)
    plain = not size or math.isinf(size) or _PLAIN[0] <= size < _PLAIN[1]
    return 0 if plain else 3 * math.floor(math.log10(size) / 3)


def format_number(value: float, spec: str = ".2g", *, limit: float = math.nan) -> str:
    """Return a number rounded as `spec` says, without a power of ten for a large one.

    With more digits where it would read as the limit that is shown beside it, and is not.

    Examples
    --------
    >>> [format_number(x, "+.2g") for x in (104.2, 7.36, -290.0, 2e-9)]
    ['+104', '+7.4', '−290', '+2·10⁻⁹']
    >>> format_number(15.2, limit=15.0), format_number(99.98, ".0f", limit=100.0)
    ('15.2', '99.98')
    """
    text = format(value, spec)
    for digits in range(3, 18):  # 17 tell any two numbers apart
        if value == limit or not math.isclose(float(text), limit, rel_tol=1e-14):
            break
        text = format(value, f".{digits}g")
    whole = "e+" in text and abs(value) < 1e6
    return _written(format(value, f"{'+' if '+' in spec else ''}.0f") if whole else text)


class Shown(float):
    """A number that a template rounds, by `format_number`."""

    limit: float = math.nan

    def __format__(self, spec: str) -> str:
        """Return it rounded as `spec` says."""
        return format_number(float(self), spec or ".3g", limit=self.limit)
