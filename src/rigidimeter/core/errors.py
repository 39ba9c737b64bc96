"""The one exception that is meant for the person at the keyboard."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

_PAIR = re.compile(
    r"--(column|unit|scale|offset) (?:([a-z_]+)='?([^\s',;:)]+)'?|'([a-z_]+)=([^']+)')"
)
_OPTION = re.compile(r"(?<![\w-])--(?!cpu\b)([a-z][a-z-]*)(?: (NAME|iv|sinusoid)\b)?")
"""One that is not of a rig; with some values it becomes an argument and its value."""

_IN_PYTHON = (
    (r"`?rigidimeter model --compare`?", "rigidimeter.fit_terms(recording, compare=True)"),
    (r"`?rigidimeter model --terms ([\w,+-]*[\w+-])`?", r"rigidimeter.fit_terms(recording, '\1')"),
    (
        r"--controller (\S+) (\S*\w)",
        r"settings={'controller': {'inertia_kg_m2': \1, 'damping_nm_s_rad': \2}}",
    ),
    ("--keep-active", "settings={'estimation': {'leave_out_active': False}}"),
    (
        "--band-hz",
        "settings={'estimation': {'band_low_hz': …, 'band_high_closed_loop_hz': …}}",
    ),
    ("--reaction", "reaction=True"),
    ("--missing none", "missing='none'"),
    (", or group= in Python", ""),
)
"""Words of the command line, as patterns, and what does the same in Python."""


class UserError(Exception):
    """Something the user can put right, said in one plain sentence.

    The command line prints the sentence and exits with a non-zero status, without a traceback.
    The sentence names the file, the field and the value, and says what would be right. Where
    several things are wrong, each is a line of its own.

    Attributes
    ----------
    lines : tuple of str
    places : mapping of str to str
        The sentence of each value that is wrong, by its key in a file or a form.
    """

    def __init__(self, *lines: str, places: Mapping[str, str] | None = None) -> None:
        super().__init__("\n".join(lines))
        self.lines, self.places = lines, places or {}


@contextmanager
def refused(path: Path, what: str) -> Iterator[None]:
    """Say of a file or folder what the operating system refuses, such as ``cannot be written``.

    Raises
    ------
    UserError
        In place of an `OSError`, with its reason.
    """
    try:
        yield
    except OSError as error:
        raise UserError(f"{path}: {what} ({error.strerror or error})") from None


def arguments_named(message: str) -> str:
    """Return a message with Python's arguments in place of options of the command line.

    Examples
    --------
    >>> arguments_named("joint.csv has no column time_s; say --rate-hz or --column time_s=t")
    "joint.csv has no column time_s; say rate_hz or column={'time_s': 't'}"
    """
    text = _PAIR.sub(r"\1={'\2\4': '\3\5'}", message)
    for words, there in _IN_PYTHON:
        text = re.sub(words, there, text)
    return _OPTION.sub(_argument, text)


def _argument(option: re.Match[str]) -> str:
    name = option[1].replace("-", "_")
    return f"{name}='{option[2]}'" if option[2] else name
