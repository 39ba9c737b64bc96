"""A checksum that lies within the bytes it covers.

It is the BLAKE2b digest of 16 bytes, as 32 hexadecimal digits, of all bytes with zeros in place of
these digits. They follow the first ``"checksum": "``, whether the bytes are a line of JSON, a JSON
file, or a message of an Arrow stream whose metadata are JSON. RFC 7693 defines BLAKE2b.

A flipped bit in the digits is noticed as one elsewhere is: 2^-128 of all damage passes.
"""

from __future__ import annotations

import hashlib
import json
from typing import Any

FIELD = b'"checksum": "'
ZEROS = "0" * 32
"""In place of the digits before they are known."""

_DECODER = json.JSONDecoder()


def digest_hex(*contents: bytes | memoryview) -> str:
    """Return the digest of bytes one after another, as hexadecimal digits."""
    digest = hashlib.blake2b(digest_size=len(ZEROS) // 2)
    for content in contents:
        digest.update(content)
    return digest.hexdigest()


def with_checksum(content: bytes, context: bytes = b"") -> bytes:
    """Return bytes with their checksum in place of its zeros.

    Parameters
    ----------
    content : bytes
        Hold `FIELD` and `ZEROS` after it.
    context : bytes
        What is covered too but lies elsewhere, such as the names of the columns.
    """
    at = content.index(FIELD) + len(FIELD)
    stop = at + len(ZEROS)
    if content[at:stop] != ZEROS.encode():
        raise ValueError("there is no room for a checksum")
    return content[:at] + digest_hex(context, content).encode() + content[stop:]


def checksum_holds(content: bytes, context: bytes = b"") -> bool:
    """Whether the bytes hold a checksum, and it is theirs.

    Examples
    --------
    >>> line = with_checksum(b'{"checksum": "' + ZEROS.encode() + b'", "event": "a"}')
    >>> checksum_holds(line), checksum_holds(line.replace(b"a", b"b"))
    (True, False)
    """
    at = content.find(FIELD) + len(FIELD)
    stop = at + len(ZEROS)
    if at < len(FIELD):
        return False
    zeroed = (content[:at], ZEROS.encode(), content[stop:])
    return content[at:stop] == digest_hex(context, *zeroed).encode()


def covered_values(content: bytes) -> dict[str, Any]:
    """Return the JSON object within the bytes that begins with their checksum.

    Call it for bytes whose checksum holds.
    """
    # JSON has no zero byte; behind it in a message there may be megabytes that are no text.
    text = content[content.index(FIELD) - 1 :].partition(b"\0")[0].decode(errors="replace")
    values: dict[str, Any] = _DECODER.raw_decode(text)[0]
    return values
