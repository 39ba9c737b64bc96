"""Text that a person entered into a form: numbers, names, and what is wrong with them."""

from __future__ import annotations

import math
import re

from rigidimeter.core.errors import UserError

_PLAIN = re.compile(r"[-+\u2212]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE | re.ASCII)
_COMMA = re.compile(r"([-+\u2212]?\d*),(\d+)", re.ASCII)
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,39}")


def parse_number(text: str, what: str) -> float:
    """Return the number that was entered, with a decimal point or a decimal comma.

    A comma before three digits may separate thousands, so it is refused.

    Raises
    ------
    UserError
        If it is no number, or may be two different ones.

    Examples
    --------
    >>> parse_number("1,5", "amplitude"), parse_number(" 20 ", "duration")
    (1.5, 20.0)
    """
    plain = text.strip().replace("\N{NO-BREAK SPACE}", "")
    comma = _COMMA.fullmatch(plain)
    if comma is not None and comma[1].lstrip("+-\u2212") not in ("", "0") and len(comma[2]) == 3:
        raise UserError(
            f"{what}: {text.strip()} may be {plain.replace(',', '.')} or "
            f"{plain.replace(',', '')}; write it without a comma"
        )
    plain = plain.replace(",", ".") if comma is not None else plain
    if _PLAIN.fullmatch(plain) is None:
        raise UserError(f"{what}: {text.strip()[:60]!r} is no number; write one like 1.5 or 1,5")
    value = float(plain.replace("\u2212", "-"))
    if not math.isfinite(value):
        raise UserError(f"{what}: {text.strip()[:60]} is too large; at most 1e308 is possible")
    return value


def parse_numbers(text: str, what: str) -> list[float]:
    """Return the times that were entered, with semicolons between them.

    Raises
    ------
    UserError
        If there is none, one is no number, or a comma may be a point or a semicolon.
    """
    parts = [part for part in text.split(";") if part.strip()]
    if not parts:
        raise UserError(f"{what}: write times in s, such as 10; 20")
    before, comma, behind = text.strip().partition(",")
    if comma and len(parts) == 1 and len(behind) > 1:
        raise UserError(
            f"{what}: {text.strip()} may be one time, {before}.{behind}, or two, "
            f"{before}; {behind}; write it with a point or a semicolon"
        )
    return [parse_number(part, what) for part in parts]


def parse_integer(text: str, what: str) -> int:
    """Return the whole number that was entered.

    Raises
    ------
    UserError
        If it is none.
    """
    value = parse_number(text, what)
    if value != int(value):
        raise UserError(f"{what}: {text.strip()} is not a whole number")
    return int(value)


def parse_name(text: str, what: str) -> str:
    """Return a name that can be a folder's: letters, digits, - and _, at most 40.

    Raises
    ------
    UserError
        If it holds anything else, or nothing.

    Examples
    --------
    >>> parse_name("S01", "subject")
    'S01'
    """
    stripped = text.strip()
    if not stripped:
        raise UserError(f"{what}: must be given")
    if _NAME.fullmatch(stripped) is None:
        raise UserError(
            f"{what}: {stripped[:60]!r} is not allowed; use 1 to 40 letters A-Z, digits, - and _, "
            "the first a letter or digit"
        )
    return stripped


def parse_line(text: str, what: str, max_length: int = 200) -> str:
    """Return one line of text, which may be empty.

    Raises
    ------
    UserError
        If it is too long, or holds characters that cannot be shown.
    """
    stripped = text.strip()
    if len(stripped) > max_length:
        raise UserError(f"{what} has {len(stripped)} characters; {max_length} are possible")
    if not stripped.isprintable():
        raise UserError(f"{what} holds characters that cannot be shown, such as a line feed")
    return stripped
