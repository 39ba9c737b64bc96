"""What the name of a column says: a quantity, and a unit where it states one.

`angle [deg]`, `Angle (°)`, `Torque_Nm`, `t / ms`, `Winkel, Grad` and `Zeit in ms` state a unit;
`torque` does not.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from rigidimeter.analysis.reading_anew.quantities import QUANTITIES, kind_of, words_of
from rigidimeter.analysis.reading_anew.units import measures, unit_of

_BRACKETS = re.compile(r"(.*?)[\s_]*[\[({<]([^\[\](){}<>]*)[\])}>]\s*", re.DOTALL)
SCALED = re.compile(
    r"(?i)(?:(?<![a-z])x|[×*·])\s*10+\b|/\s*10+\s*$|\b1/10+\b|\b10+\s*[x×*·]|\b10\s*\^"
    r"|(?<![\d.])0[.,]\d|\de-?\d"
)
"""A power of ten in a name: its unit is not that of the values, as in ``Angle*10 [deg]``."""
_NO_UNIT = re.compile(r"(?i)[\W_\d]*|n\W?a\W?|none|null|unknown|units?|a\W?u\W?|arb\b.*|.*less")
_SEPARATED = re.compile(r"(.*\S)\s*(?:\s/\s|/|,|;|:|\sin\s|\s-\s)\s*(\S.*)", re.DOTALL)


class Header(NamedTuple):
    """What a column is by its name.

    Attributes
    ----------
    kind : str
        A quantity, ``force``, or nothing.
    unit : str
        As stated; nothing where no unit is.
    stated_twice : str
        A second unit, of another size, where the name and the file state two.
    unknown : str
        What brackets hold that is no unit that is known.
    """

    kind: str
    unit: str = ""
    stated_twice: str = ""
    unknown: str = ""


def read_header(name: str, unit: str = "") -> Header:
    """Read the name of a column.

    Parameters
    ----------
    name : str
    unit : str
        What the file states elsewhere, such as in a row of units.

    Examples
    --------
    >>> read_header("Drehmoment [Nm]").unit, read_header("elbow_angle_deg").kind
    ('Nm', 'angle')
    """
    last = name.rsplit("/", 1)[-1] if name.count("/") and not _BRACKETS.fullmatch(name) else name
    for text in dict.fromkeys((name, last)):
        found = _by_name(text)
        if found.kind:
            break
    if _NO_UNIT.fullmatch(unit) or not (unit_of(unit) or found.unit):
        return found
    if found.unit and unit_of(found.unit) != unit_of(unit):
        return Header(found.kind, unit, found.unit)
    return Header(found.kind, unit)


def _by_name(name: str) -> Header:
    bracketed = _BRACKETS.fullmatch(name)
    if bracketed is not None and unit_of(bracketed[2]):
        scaled = SCALED.search(bracketed[1])
        return Header(_kind(bracketed[1]), "" if scaled else bracketed[2].strip())
    separated = _SEPARATED.fullmatch(name)
    if separated is not None and fits(_kind(separated[1]), separated[2]):
        return Header(_kind(separated[1]), separated[2].strip())
    parts = re.split(r"[\s_]+", name.strip())
    for count in (3, 2, 1):
        if count < len(parts):
            kind, unit = _kind(" ".join(parts[:-count])), "_".join(parts[-count:])
            if fits(kind, unit) and _is_whole(unit) and not SCALED.search(" ".join(parts)):
                return Header(kind, unit)
    alone = unit_of(name)
    if len(name.strip()) > 1 and alone and measures(alone, "time") and alone.size <= 1.0:
        return Header("time", name.strip())  # such as mSec; `min` may be a minimum
    unknown = "" if bracketed is None else bracketed[2].strip()
    is_place = unknown.isdigit()  # of a column of a matrix, as q[3]
    return Header(_kind(name), unknown="" if is_place or unit_of(unknown) else unknown)


def _is_whole(unit: str) -> bool:
    """Whether it is no piece of what brackets hold, as of `(0.1 deg)`."""
    return all(unit.count(a) == unit.count(b) for a, b in ("()", "[]", "{}", "<>"))


def _kind(text: str) -> str:
    last = text.rsplit(".", 1)[-1]  # of fields of a structure the last one names it
    return kind_of(words_of(last)) or kind_of(words_of(text))


def fits(kind: str, unit: str) -> bool:
    """Whether a unit is one of a quantity, or counts; of a force, one of force."""
    found = unit_of(unit)
    if kind not in QUANTITIES and kind != "force":
        return False
    if found is not None and found == unit_of("count"):  # a calibration makes it a quantity
        return kind not in ("time", "force")
    return measures(found, kind)
