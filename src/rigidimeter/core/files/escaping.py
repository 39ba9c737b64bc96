r"""Text as it may be shown and as a cell of a table: nothing in it commands a terminal or a sheet.

A control character, such as ESC, which begins the commands of a terminal, is written as its
escape (``\x1b``). A cell of a table that begins with ``=``, ``+``, ``-``, ``@``, one of these in
full width, a tab or a line feed and is no number would be a formula to a spreadsheet; an apostrophe
before it makes it text there. Readers of tables take one such apostrophe off again. Source: OWASP,
"CSV Injection".
"""

from __future__ import annotations

import re

# C0 and C1, and what turns the direction of text or breaks lines.
_COMMANDS = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
_LINES = re.compile(_COMMANDS.pattern.replace("\x00-\x1f", "\x00-\x08\x0b-\x1f"))
_FORMULA = re.compile("'*[=+\\-@\t\n\uff1d\uff0b\uff0d\uff20]")
NUMBER_TEXT = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")
"""A number as tables hold it, with a decimal point or comma."""


def visible(text: str, *, lines: bool = False) -> str:
    r"""Return text with every control character as its escape.

    Parameters
    ----------
    text : str
    lines : bool
        Line feeds and tabs stay what they are.

    Examples
    --------
    >>> visible("a\x1b[31m")
    'a\\x1b[31m'
    """
    return (_LINES if lines else _COMMANDS).sub(
        lambda found: found[0].encode("unicode_escape").decode("ascii"), text
    )


def as_written(text: str) -> str:
    """Return text as a cell of a CSV file holds it.

    Examples
    --------
    >>> [as_written(text) for text in ("=1+1", "-0.5", "-a", "'=", "OFF")]
    ["'=1+1", '-0.5', "'-a", "''=", 'OFF']
    """
    text = visible(text, lines=True)  # a line feed within a cell is quoted
    return f"'{text}" if _FORMULA.match(text) and not NUMBER_TEXT.fullmatch(text) else text


def as_read(text: str) -> str:
    """Return a cell of a CSV file as it was before `as_written`; a control character stays escaped.

    Examples
    --------
    >>> [as_read(text) for text in ("'=1+1", "-0.5", "''=", "'quoted'")]
    ['=1+1', '-0.5', "'=", "'quoted'"]
    """
    return text[1:] if text[:1] == "'" and _FORMULA.match(text) else text


def printable(name: str) -> str:
    """Return a name without line feeds and the like, for messages."""
    return "".join(letter if letter.isprintable() else "?" for letter in name)
