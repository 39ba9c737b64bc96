"""What the name of a column says: a quantity, and a unit where it states one.

`angle [deg]`, `Angle (°)`, `Torque_Nm`, `t / ms`, `Winkel, Grad` and `Zeit in ms` state a unit;
`torque` does not.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from rigidimeter.analysis.reading.channels.quantities import (
    BY_STANDARD,
    QUANTITIES,
    kind_of,
    words_of,
)
from rigidimeter.analysis.reading.channels.unit_text import expression, factor, ratio

_STORED = {one.name: one.standard for one in QUANTITIES}
_TIMES = ("second", "millisecond", "microsecond")
"""A column with only such a name, such as ``mSec``, is the time."""
_BRACKETS = re.compile(r"(.*?)[\s_]*[\[({<]([^\[\](){}<>]*)[\])}>]\s*", re.DOTALL)
SCALED = re.compile(
    r"(?i)(?:(?<![a-z])x|[×*·])\s*10+\b|/\s*10+\s*$|\b1/10+\b|\b10+\s*[x×*·]|\b10\s*\^"
    r"|(?<![\d.])0[.,]\d|\de-?\d"
)
"""A power of ten in a name: its unit is not that of the values, as in ``Angle*10 [deg]``."""
_NO_UNIT = re.compile(r"(?i)[\W_\d]*|n\W?a\W?|none|null|unknown|units?|a\W?u\W?|arb\b.*|.*less")
_SEPARATED = re.compile(r"(.*\S)\s*(?:\s/\s|/|,|;|:|\sin\s|\s-\s)\s*(\S.*)", re.DOTALL)


@dataclass(frozen=True)
class Header:
    """What a column is by its name.

    Parameters
    ----------
    kind : str
        A quantity, ``force``, or nothing.
    unit : str
        As stated; nothing where no unit is.
    stated_twice : str
        A second unit, of another size, where the name and the file state two.
    in_brackets : str
        What brackets hold that is no unit that is known.
    """

    kind: str
    unit: str
    stated_twice: str = ""
    in_brackets: str = ""


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
        found = _own(text)
        if found.kind:
            break
    if _NO_UNIT.fullmatch(unit) or not (expression(unit) or found.unit):
        return found
    if found.unit and expression(found.unit) != expression(unit):
        return Header(found.kind, unit, found.unit)
    return Header(found.kind, unit)


def _own(name: str) -> Header:
    bracketed = _BRACKETS.fullmatch(name)
    if bracketed is not None and expression(bracketed[2]):
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
    if len(name.strip()) > 1 and expression(name) in _TIMES:
        return Header("time", name.strip())
    in_brackets = "" if bracketed is None else bracketed[2].strip()
    return Header(_kind(name), "", in_brackets="" if expression(in_brackets) else in_brackets)


def _is_whole(unit: str) -> bool:
    """Whether it is no piece of what brackets hold, as of `(0.1 deg)`."""
    return all(unit.count(a) == unit.count(b) for a, b in ("()", "[]", "{}", "<>"))


def _kind(text: str) -> str:
    words = words_of(text)
    last = text.rsplit(".", 1)[-1]  # of fields of a structure the last one names it
    return kind_of(words_of(last)) or kind_of(words)


def fits(kind: str, unit: str) -> bool:
    """Whether a unit is one of a quantity, or counts; of a force, one of force."""
    if kind == "force":
        return ratio(expression(unit), "newton") is not None
    standard = _STORED.get(kind, "")
    if expression(unit) == "count":  # of a converter, which a calibration makes a quantity
        return standard in BY_STANDARD and kind != "time"
    return standard in BY_STANDARD and expression(unit) != "" and factor(unit, standard) is not None
