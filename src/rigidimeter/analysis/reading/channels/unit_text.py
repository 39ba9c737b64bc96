"""Units as people write them, turned into SI by `pint`.

`deg`, `°`, `Grad`, `Nm`, `N·m`, `Nmm`, `ft-lb`, `°/s`, `deg_s`, `Sek`: what stands in a header is
first written as `pint` reads it. What could mean two things (`grad`: degrees in German, gons in
France) is not a unit.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from rigidimeter.analysis.reading.channels.quantities import BY_STANDARD

if TYPE_CHECKING:
    import pint

_SPELLED: Mapping[str, str] = {
    "degree": "deg degs degree degrees Grad grados gradi degre degres degré degrés graden °",
    "millidegree": "mdeg",
    "radian": "rad rads radian radians Radiant radianti radianes radiani",
    "milliradian": "mrad",
    "turn": "rev revs revolution revolutions turn turns U tr giri giro",
    "gon": "gon",
    "second": "s sec secs second seconds Sek sek Sekunde Sekunden seconde secondes secondi "
    "segundo segundos seg seconden",
    "millisecond": "ms msec msecs millisecond milliseconds Millisekunde Millisekunden "
    "milliseconde milliseconden",
    "microsecond": "us µs usec microsecond microseconds Mikrosekunden",
    "nanosecond": "ns nanoseconds",
    "minute": "min mins minute minutes Minuten",
    "hour": "h hour hours",
    "day": "d day days Tag Tage jours giorni dias",
    "newton": "N Newton newton newtons",
    "kilonewton": "kN",
    "millinewton": "mN",
    "force_pound": "lb lbs lbf",
    "force_ounce": "oz ozf",
    "kilogram_force": "kgf kp",
    "foot": "ft foot feet",
    "inch": "in inch inches",
    "meter": "m meter metre meters metres Meter",
    "centimeter": "cm",
    "millimeter": "mm",
    "volt": "V Volt volt volts",
    "millivolt": "mV mv",
    "microvolt": "uV µV uv",
    "ampere": "A amp amps ampere amperes Ampere",
    "milliampere": "mA",
    "percent": "% percent",
    "permille": "‰ permille",
    "bar": "bar",
    "pascal": "Pa",
    "kilopascal": "kPa",
    "hertz": "Hz",
    "arcminute": "arcmin",
    "arcsecond": "arcsec",
    "count": "count counts cts digits LSB bit bits tick ticks raw",
}
_UNIT: Mapping[str, str] = {one: unit for unit, text in _SPELLED.items() for one in text.split()}
_NEWTON_METER = re.compile(r"([munkcdM]?)N(m|cm|mm)", re.ASCII)
_PREFIX = {"m": "milli", "u": "micro", "n": "nano", "k": "kilo", "c": "centi", "d": "deci",
           "M": "mega", "": ""}  # fmt: skip
_LENGTH = {"m": "meter", "cm": "centimeter", "mm": "millimeter"}
_WHOLE: Mapping[str, str] = {
    "dps": "degree/second",
    "rpm": "turn/minute",
    "nm": "newton*meter",  # nothing that is read here is measured in nanometres
    "NM": "newton*meter",
    "N-M": "newton*meter",
    "FT-LBS": "foot*force_pound",
    "FT-LB": "foot*force_pound",
}
_RATIO_BELOW = re.compile(r"([^/()]+)/\s*\(([^/()]+)/([^/()]+)\)")
_LONGEST = 40
_ANGLES = ("radian", "degree", "turn", "grade", "gon", "arcminute", "arcsecond",
           "revolutions_per_minute")  # fmt: skip
_NO_TORQUE = ("joule", "calorie", "electron_volt", "watt")


@functools.cache
def registry() -> pint.UnitRegistry[float]:
    """Return `pint`'s units; reading their definitions takes about 0.2 s."""
    import pint

    return pint.UnitRegistry()


@functools.lru_cache(maxsize=4096)
def expression(text: str) -> str:
    """Return a unit as `pint` writes it; nothing where the text is not a unit.

    Examples
    --------
    >>> expression("°/s"), expression("N.m"), expression("rad_s"), expression("left")
    ('degree/(second)', 'newton*meter', 'radian/(second)', '')
    >>> expression("Nm/(mV/V)")
    'newton*meter*volt/(millivolt)'
    """
    text = text.strip().replace("º", "°").replace("μ", "µ").replace("⁻¹", "^-1")
    if not text or len(text) > _LONGEST:
        return ""
    if text in _WHOLE:
        return _WHOLE[text]
    text = re.sub(r"(?i)(?<=[\w°])[\s_]*\bper\b[\s_]*|_per_", "/", text)
    text = re.sub(r"^(rad|deg|mrad)_s$", r"\1/s", text)
    nested = _RATIO_BELOW.fullmatch(text)
    if nested:  # divided by a ratio is times its inverse
        text = f"{nested[1]}·{nested[3]}/{nested[2]}"
    above: list[str] = []
    below: list[str] = []
    for index, part in enumerate(text.split("/")):
        for token in re.findall(r"[^\s·⋅*._()-]+(?:-1)?", part.replace("^-1", "-1")):
            inverse = token.endswith("-1")
            unit = _token(token.removesuffix("-1"))
            if not unit:
                return ""
            (below if inverse != bool(index) else above).append(unit)
    if not above:
        return ""
    return "*".join(above) + (f"/({'*'.join(below)})" if below else "")


def _token(token: str) -> str:
    if token in _UNIT:
        return _UNIT[token]
    found = _NEWTON_METER.fullmatch(token)
    if found:
        return f"{_PREFIX[found[1]]}newton*{_LENGTH[found[2]]}"
    return _UNIT.get(token.lower(), "") if len(token) > 2 and token.lower() != "grad" else ""


def factor(text: str, standard: str, scale: str = "") -> float | None:
    """Return what a value of a unit is in the unit of a stored channel; None where it is no such.

    Parameters
    ----------
    text : str
        The unit of the values.
    standard : str
        The channel, such as ``torque_nm``.
    scale : str
        A number with a unit by which the values are multiplied first, such as ``2.5 Nm/V``.

    Examples
    --------
    >>> factor("mV", "torque_nm", "2.5 Nm/V"), factor("N", "torque_nm", "0.25 m")
    (0.0025, 0.25)
    >>> factor("mm", "angle_rad") is None
    True
    """
    si = BY_STANDARD[standard].si
    written = expression(text)
    number, times = split_number(scale) if scale else (1.0, "")
    if times is None:
        return None
    if not scale and written == si:
        return 1.0
    if not written and not times:
        return None
    units = registry()
    own, more = units.Unit(written or "dimensionless"), units.Unit(times or "dimensionless")
    is_share = own.dimensionless and (1.0 * own).to("").magnitude != 1.0
    if is_share and _is(more, standard) and not _names(own) & _names(more):
        return None  # 2.5 Nm of a column in %: for 1 %, or for 100?
    unit = own * more
    return float(number * (1.0 * unit).to(si).magnitude) if _is(unit, standard) else None


def split_number(text: str) -> tuple[float, str | None]:
    """Split ``2.5 Nm/V`` into its number and its unit as `pint` writes it, None if it is none."""
    found = re.fullmatch(r"\s*([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", text)
    if found is None:
        return 0.0, None
    number = float(found[1].replace(",", "."))
    if not found[2]:
        return number, ""
    return number, expression(found[2]) or None


def divided_by(scale: str) -> str:
    """Return the unit by which a scale divides last, nothing where it divides by none.

    Examples
    --------
    >>> divided_by("2.5 Nm/V"), divided_by("0.5 Nm/(mV/V)"), divided_by("20 deg/s/V")
    ('V', 'mV/V', 'V')
    """
    found = re.fullmatch(r".*/\s*(?:\(([^()]+)\)|([^()/]+))\s*", scale)
    unit = (found[1] or found[2]).strip() if found else ""
    return unit if expression(unit) else ""


def ratio(written: str, other: str) -> float | None:
    """Return what one of a unit is in another, both as `pint` writes them; None where it is none.

    Examples
    --------
    >>> ratio("millivolt", "volt"), ratio("volt", "meter")
    (0.001, None)
    """
    if not written or not other:
        return None
    units = registry()
    one, wanted = units.Unit(written), units.Unit(other)
    if one.dimensionality != wanted.dimensionality:
        return None
    return float((1.0 * one).to(wanted).magnitude)


def _names(unit: pint.Unit) -> set[str]:
    """Return the names of the units that a unit is made of."""
    return {str(name) for name, _ in (1.0 * unit).unit_items()}


def _is(unit: pint.Unit, standard: str) -> bool:
    """Whether a unit is one of a channel.

    What has one dimension is told apart: N·m and J, rad/s and Hz, rad and a bare number.
    """
    if unit.dimensionality != registry().Unit(BY_STANDARD[standard].si).dimensionality:
        return False
    parts = _names(unit)
    angular = [part for part in parts if part.endswith(_ANGLES)]
    if standard in ("angle_rad", "velocity_rad_s", "velocity_command_rad_s"):
        return len(angular) % 2 == 1
    if standard in ("torque_nm", "perturbation_nm"):
        return not angular and not any(part.endswith(_NO_TORQUE) for part in parts)
    return not angular
