"""The token of the page: made anew, or kept in a file that nobody but its owner can read.

It stands in the link that is printed, and never among the arguments of a program, which every user
of a computer can list.
"""

from __future__ import annotations

import os
import re
import secrets
import stat
from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.rig.console.page.access import is_loopback

_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,200}")
_LONGEST = 1000


def new_token() -> str:
    """Return a random token of 192 bits."""
    return secrets.token_urlsafe(24)


def require_token(token: str, host: str) -> None:
    """Refuse a token that can be guessed, and none where a network reaches the page.

    Raises
    ------
    UserError
    """
    if not token and not is_loopback(host):
        raise UserError(
            f"--no-token: whoever reaches {host} over the network could lead the rig; leave it "
            "out, or serve the page on 127.0.0.1"
        )
    if token and _TOKEN.fullmatch(token) is None:
        raise UserError(
            f"the token has {len(token)} characters, can be guessed or does not fit into an "
            "address; use 16 or more of A-Z, a-z, digits, - and _"
        )


def token_in(path: Path) -> str:
    """Return the token that a file holds; where there is no file it is made, with a new token.

    Raises
    ------
    UserError
        If the file holds no token, is readable by others, or cannot be read or made.
    """
    try:
        made = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return _read(path)
    except OSError as error:
        raise UserError(f"{path}: the token cannot be written there ({error.strerror})") from None
    with os.fdopen(made, "w", encoding="ascii") as file:
        token = new_token()
        file.write(f"{token}\n")
    return token


def _read(path: Path) -> str:
    try:
        # A pipe without a writer would be waited for.
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
            status = os.fstat(file.fileno())
            text = file.read(_LONGEST) if stat.S_ISREG(status.st_mode) else b""
    except OSError as error:
        raise UserError(f"{path}: the token cannot be read ({error.strerror})") from None
    mode = stat.S_IMODE(status.st_mode)
    if status.st_uid != os.geteuid() or mode & 0o077:
        raise UserError(
            f"{path}: others can read or change the token (mode {mode:04o}); delete the file, and "
            "one of mode 0600 with a new token is made"
        )
    token = text.decode("ascii", errors="replace").strip()
    try:
        require_token(token or "-", "localhost")
    except UserError as error:
        raise UserError(f"{path}: {error}") from None
    return token
