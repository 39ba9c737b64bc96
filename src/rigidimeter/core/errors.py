"""The one exception that is meant for the person at the keyboard."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_PAIR = re.compile(
    r"--(column|unit|scale|offset) (?:([a-z_]+)='?([^\s',;:)]+)'?|'([a-z_]+)=([^']+)')"
)
_OPTION = re.compile(r"(?<![\w-])--([a-z][a-z-]*)")


class UserError(Exception):
    """Something the user can put right, said in one plain sentence.

    The command line prints the sentence and exits with a non-zero status, without a traceback.
    The sentence names the file, the field and the value, and says what would be right. Where
    several things are wrong, each is a line of its own.
    """

    def __init__(self, *lines: str) -> None:
        super().__init__("\n".join(lines))
        self.lines = lines


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
    text = _PAIR.sub(r"\1={'\2\4': '\3\5'}", message).replace("--reaction", "reaction=True")
    text = text.replace("--missing none", "missing='none'")
    return _OPTION.sub(lambda found: found[1].replace("-", "_"), text)
