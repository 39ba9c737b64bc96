"""Units as people write them, as a factor and a dimension.

`deg`, `°`, `Grad`, `Nm`, `N·m`, `Nmm`, `ft-lb`, `°/s`, `deg_s`, `Sek`: a unit is a product of
spellings, each a number of base units. The radian is a base, so that rad/s is not Hz; the newton is
one, and joules are in no row, so that N·m is no energy. What could mean two things (`grad`: degrees
in German, gons in France) is not a unit. A ratio such as mV/V keeps a dimension of its own.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from rigidimeter.core.errors import UserError

_ROWS: tuple[tuple[str, float, str], ...] = (
    ("rad", math.pi / 180, "deg degs degree degrees Grad grados gradi degre degres degré degrés "
     "graden °"),
    ("rad", math.pi / 180 / 1000, "mdeg"),
    ("rad", 1.0, "rad rads radian radians Radiant radianti radianes radiani"),
    ("rad", 1e-3, "mrad"),
    ("rad", 2 * math.pi, "rev revs revolution revolutions turn turns U tr giri giro"),
    ("rad", math.pi / 200, "gon"),
    ("rad", math.pi / 180 / 60, "arcmin"),
    ("rad", math.pi / 180 / 3600, "arcsec"),
    ("s", 1.0, "s sec secs second seconds Sek sek Sekunde Sekunden seconde secondes secondi "
     "segundo segundos seg seconden"),
    ("s", 1e-3, "ms msec msecs millisecond milliseconds Millisekunde Millisekunden milliseconde "
     "milliseconden"),
    ("s", 1e-6, "us µs usec microsecond microseconds Mikrosekunden"),
    ("s", 1e-9, "ns nanoseconds"),
    ("s", 60.0, "min mins minute minutes Minuten"),
    ("s", 3600.0, "h hour hours"),
    ("s", 86400.0, "d day days Tag Tage jours giorni dias"),
    ("N", 1.0, "N Newton newton newtons"),
    ("N", 1e3, "kN"),
    ("N", 1e-3, "mN"),
    ("N", 4.4482216152605, "lb lbs lbf"),
    ("N", 4.4482216152605 / 16, "oz ozf"),
    ("N", 9.80665, "kgf kp"),
    ("m", 0.3048, "ft foot feet"),
    ("m", 0.0254, "in inch inches"),
    ("m", 1.0, "m meter metre meters metres Meter"),
    ("m", 1e-2, "cm"),
    ("m", 1e-3, "mm"),
    ("V", 1.0, "V Volt volt volts"),
    ("V", 1e-3, "mV mv"),
    ("V", 1e-6, "uV µV uv"),
    ("A", 1.0, "A amp amps ampere amperes Ampere"),
    ("A", 1e-3, "mA"),
    ("%", 1.0, "% percent"),
    ("%", 0.1, "‰ permille"),
    ("Pa", 1e5, "bar"),
    ("Pa", 1.0, "Pa"),
    ("Pa", 1e3, "kPa"),
    ("Hz", 1.0, "Hz"),
    ("count", 1.0, "count counts cts digits LSB bit bits tick ticks raw"),
)  # fmt: skip
_SPELLED: Mapping[str, tuple[str, float]] = {
    spelling: (base, size) for base, size, spellings in _ROWS for spelling in spellings.split()
}
_WHOLE: Mapping[str, str] = {
    "dps": "deg/s",
    "rpm": "rev/min",
    "nm": "N·m",  # nothing that is read here is measured in nanometres
    "NM": "N·m",
    "N-M": "N·m",
    "FT-LBS": "ft·lb",
    "FT-LB": "ft·lb",
}
_NEWTON_METRE = re.compile(r"([munkcdM]?)N(m|cm|mm)", re.ASCII)
_PREFIXES = {"": 1.0, "m": 1e-3, "u": 1e-6, "n": 1e-9, "k": 1e3, "c": 1e-2, "d": 0.1, "M": 1e6}
_NESTED = re.compile(r"([^/()]+)/\s*\(([^/()]+)/([^/()]+)\)")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")
_LONGEST = 40
RATIO = "ratio"
"""The dimension of a unit whose parts cancel, such as mV/V."""

Dimension = frozenset[tuple[str, int]]
_DIMENSIONS: Mapping[str, Dimension] = {
    "time": frozenset({("s", 1)}),
    "angle": frozenset({("rad", 1)}),
    "velocity": frozenset({("rad", 1), ("s", -1)}),
    "velocity_command": frozenset({("rad", 1), ("s", -1)}),
    "torque": frozenset({("N", 1), ("m", 1)}),
    "perturbation": frozenset({("N", 1), ("m", 1)}),
    "force": frozenset({("N", 1)}),
}
_VOLTAGE: Dimension = frozenset({("V", 1)})
_COUNT: Dimension = frozenset({("count", 1)})


class Unit(NamedTuple):
    """What 1 of a unit is in base units (rad, s, N, m, V, …), and their powers."""

    size: float
    dimension: Dimension

    def times(self, other: Unit) -> Unit:
        """Return the product of two units."""
        powers = Counter(dict(self.dimension))
        powers.update(dict(other.dimension))
        return Unit(self.size * other.size, frozenset((base, n) for base, n in powers.items() if n))

    @property
    def inverse(self) -> Unit:
        """One over the unit."""
        return Unit(1.0 / self.size, frozenset((base, -n) for base, n in self.dimension))

    @property
    def is_uncalibrated(self) -> bool:
        """Whether sensors and drives give it before a calibration: volts, counts and the like."""
        return self.dimension in {
            frozenset({(base, 1)}) for base in ("V", "A", "%", "Pa", "Hz", "count", RATIO)
        }


NO_UNIT = Unit(1.0, frozenset())


def unit_of(text: str) -> Unit | None:
    """Return a unit, None where the text is none.

    Examples
    --------
    >>> unit_of("mNm").size, unit_of("ms") == unit_of("msec"), unit_of("left")
    (0.001, True, None)
    >>> sorted(unit_of("N.m/(mV/V)").dimension)
    [('N', 1), ('m', 1), ('ratio', -1)]
    """
    text = text.strip().replace("º", "°").replace("μ", "µ").replace("⁻¹", "^-1")
    text = _WHOLE.get(text, text)
    if not text or len(text) > _LONGEST:
        return None
    text = re.sub(r"(?i)(?<=[\w°])[\s_]*\bper\b[\s_]*|_per_", "/", text)
    text = re.sub(r"^(rad|deg|mrad)_s$", r"\1/s", text)
    if (nested := _NESTED.fullmatch(text)) is not None:
        above, below = unit_of(nested[1]), unit_of(f"{nested[2]}/{nested[3]}")
        return None if above is None or below is None else above.times(below.inverse)
    found, n_above = NO_UNIT, 0
    for place, part in enumerate(text.split("/")):
        for token in re.findall(r"[^\s·⋅*._()-]+(?:-1)?", part.replace("^-1", "-1")):
            one = _spelled(token.removesuffix("-1"))
            if one is None:
                return None
            below_line = token.endswith("-1") != bool(place)
            found = found.times(one.inverse if below_line else one)
            n_above += not below_line
    if not n_above:
        return None
    return found if found.dimension else Unit(found.size, frozenset({(RATIO, 1)}))


def _spelled(token: str) -> Unit | None:
    known = _SPELLED.get(token)
    if known is None and len(token) > 2 and token.lower() != "grad":
        known = _SPELLED.get(token.lower())
    if known is not None:
        return Unit(known[1], frozenset({(known[0], 1)}))
    found = _NEWTON_METRE.fullmatch(token)
    if found is None:
        return None
    length = _SPELLED[found[2]][1]
    return Unit(_PREFIXES[found[1]] * length, frozenset({("N", 1), ("m", 1)}))


def measures(unit: Unit | None, quantity: str) -> bool:
    """Whether a unit is one of a quantity (``torque``, ``emg_2``, ``force``, …)."""
    return unit is not None and unit.dimension == _DIMENSIONS.get(quantity, _VOLTAGE)


def factor(text: str, quantity: str, scale: str = "") -> float | None:
    """Return what a value of a unit is in the unit in which a quantity is stored.

    Parameters
    ----------
    text : str
        The unit of the values; may be empty where a scale says what they become.
    quantity : str
        Such as ``torque``.
    scale : str
        A number with a unit by which the values are multiplied first, such as ``2.5 Nm/V``.

    Returns
    -------
    float or None
        None where the units do not make the quantity's.

    Examples
    --------
    >>> factor("mV", "torque", "2.5 Nm/V"), factor("N", "torque", "0.25 m")
    (0.0025, 0.25)
    >>> factor("%", "torque", "2.5 Nm"), factor("mm", "angle")
    (None, None)
    """
    own = unit_of(text) or NO_UNIT
    number, times = split_number(scale) if scale else (1.0, NO_UNIT)
    if times is None or (own is NO_UNIT and times is NO_UNIT):
        return None
    product = own.times(times)
    if own.dimension == _COUNT and ("count", 1) in product.dimension:
        product = product.times(own.inverse)  # a scale without counts is for one of them
    return number * product.size if measures(product, quantity) else None


def split_number(text: str) -> tuple[float, Unit | None]:
    """Split ``2.5 Nm/V`` into its number and its unit; the unit is None if it is none."""
    found = _NUMBER.fullmatch(text)
    if found is None:
        return 0.0, None
    number, unit = float(found[1].replace(",", ".")), unit_of(found[2]) if found[2] else NO_UNIT
    if unit is not None and unit.dimension == {(RATIO, 1)}:  # of a scale such as 2 Nm/Nm
        unit = Unit(unit.size, NO_UNIT.dimension)
    return number, unit


def divided_by(scale: str) -> str:
    """Return the unit by which a scale divides last, nothing where it divides by none.

    Examples
    --------
    >>> divided_by("2.5 Nm/V"), divided_by("0.5 Nm/(mV/V)"), divided_by("20 deg/s/V")
    ('V', 'mV/V', 'V')
    """
    found = re.fullmatch(r".*/\s*(?:\(([^()]+)\)|([^()/]+))\s*", scale)
    unit = (found[1] or found[2]).strip() if found else ""
    return unit if unit_of(unit) is not None else ""


class Conversion(NamedTuple):
    """The way to SI: (value − `offset`) times `size`; `offset` is in the column's own unit."""

    size: float = 1.0
    offset: float = 0.0


def conversion(
    quantity: str, usual: Sequence[str], column: str, unit: str, scale: str, offset: str
) -> Conversion:
    """Return how a column becomes a stored channel.

    Parameters
    ----------
    quantity : str
        Such as ``torque``.
    usual : sequence of str
        The units in which it is mostly given, the stored one first.
    column : str
    unit, scale, offset : str
        As the file and options state them, or nothing.

    Raises
    ------
    UserError
        If the units do not make the channel's.
    """
    below = "" if unit else divided_by(scale)  # "2.5 Nm/V": the column holds V
    size = factor(below, quantity, scale) if below else None
    if size is not None:
        unit = below
    else:  # "0.25 rad/s" divides by the second of its own unit
        size = factor(unit, quantity, scale)
    if size is None:
        raise UserError(_no_factor(quantity, usual, column, unit, scale))
    if size == 0.0:
        raise UserError(f"--scale '{quantity}={scale}': the number must not be 0")
    if not offset:
        return Conversion(size)
    number, stated = split_number(offset)
    own = unit_of(unit)
    if stated is NO_UNIT:
        return Conversion(size, number)
    if stated is not None and own is not None and stated.dimension == own.dimension:
        return Conversion(size, number * (stated.size / own.size))
    if stated is not None and measures(stated, quantity):
        return Conversion(size, number * stated.size / size)
    raise UserError(
        f"--offset '{quantity}={offset}': write what column {column!r} reads at zero, in "
        f"{unit or usual[0]} or {usual[0]}"
    )


def example_scale(quantity: str, stored: str, unit: str) -> str:
    """Return an option with a blank to fill in that makes a quantity of a unit."""
    if measures(unit_of(unit), "force"):
        return f"the lever arm, as in --scale '{quantity}=NUMBER m'"
    divisor = f"({unit})" if "/" in unit else unit or "V"
    return f"--scale '{quantity}=NUMBER {stored}/{divisor}'"


def _no_factor(quantity: str, usual: Sequence[str], column: str, unit: str, scale: str) -> str:
    stored = " or ".join(usual)
    if scale:
        example = example_scale(quantity, usual[0], unit).removeprefix("the lever arm, as in ")
        return (
            f"--scale '{quantity}={scale}': times the unit of column {column!r} "
            f"({unit or 'not stated'}) this does not make {stored}; write a number and a unit that "
            f"do, as in {example}"
        )
    if unit and unit_of(unit) is None:
        return f"--unit {quantity}={unit}: unknown unit {unit!r}; known are, among others, {stored}"
    return (
        f"column {column!r} is in {unit}, and {quantity} is needed in {stored}: say "
        f"{example_scale(quantity, usual[0], unit)}"
    )
