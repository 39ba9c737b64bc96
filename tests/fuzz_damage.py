"""The ways in which `tests.fuzz` damages a file."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

NUMBERS = (
    *("0", "-1", "nan", "inf", "-inf", "1e-320", "1e308", "-1e308", "1e-300", "5e-324", "true"),
    *("9" * 30, "9" * 400, "9" * 5000, "1e999", "0x10", "[]", "{}", '""', "null", '"1"', "-0.0"),
)
"""What a number is replaced by."""
VALUES = (*NUMBERS, "5", "0.5", "false", '"a"', "[1, 2]", '[["a"]]', '{"a" = 1}', '{"a": 1}')
"""What a value of a document is replaced by."""


def mutated(data: bytes, rng: np.random.Generator) -> tuple[str, bytes]:
    """Change a file in one way; return the way and the bytes."""
    ways: Sequence[Callable[[bytes, np.random.Generator], bytes]] = (
        _flip, _cut, _double, _number, _nest, _wide, _long, _encoded, _word, _value, _value,
        _swap, _head, _pickle, _bomb, _ones,
    )  # fmt: skip
    way = ways[int(rng.integers(len(ways)))]
    return way.__name__.strip("_"), way(data, rng)


def _flip(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for place in rng.integers(0, len(data), int(rng.integers(1, 4))):
        changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    start, stop = sorted(int(place) for place in rng.integers(0, len(data), 2))
    return data[:start] + (data[stop:] if rng.random() < 0.5 else b"")


def _double(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    start = int(rng.integers(len(lines)))
    times = int(rng.choice([1, 2, 1000]))
    return b"\n".join([*lines[: start + 1], *lines[start : start + 1] * times, *lines[start + 1 :]])


def _number(data: bytes, rng: np.random.Generator) -> bytes:
    found = list(re.finditer(rb"-?\d+(\.\d+)?(e-?\d+)?", data[:100_000]))
    if not found:
        return _flip(data, rng)
    one = found[int(rng.integers(len(found)))]
    return data[: one.start()] + str(rng.choice(NUMBERS)).encode() + data[one.end() :]


def _value(data: bytes, rng: np.random.Generator) -> bytes:
    """Replace what stands after a key."""
    found = list(re.finditer(rb'(?:" ?:| =) *("[^"\n]*"|[^\s,\]}]+)', data[:100_000]))
    if not found:
        return _number(data, rng)
    one = found[int(rng.integers(len(found)))]
    return data[: one.start(1)] + str(rng.choice(VALUES)).encode() + data[one.end(1) :]


def _nest(data: bytes, rng: np.random.Generator) -> bytes:
    depth = int(rng.choice([40, 5000]))
    opened, closed = [(b"[", b"]"), (b'{"a":', b"}"), (b"a.", b"")][int(rng.integers(3))]
    place = data.find(b" = " if b" = " in data else b": ", int(rng.integers(len(data)))) + 2
    return data[:place] + opened * depth + b"1" + closed * depth + data[place + 1 :]


def _wide(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    more = b"".join(b",c%d" % k for k in range(int(rng.choice([1, 3000]))))
    every = rng.random() < 0.5
    return b"\n".join(
        line + (more if every or k == 0 else b"") if line else line for k, line in enumerate(lines)
    )


def _long(data: bytes, rng: np.random.Generator) -> bytes:
    times = int(rng.choice([2, 50]))
    head, _, body = data.partition(b"\n")
    return head + b"\n" + body * times


def _encoded(data: bytes, rng: np.random.Generator) -> bytes:
    ways = (
        lambda text: text.encode("utf-16"),
        lambda text: text.encode("utf-32"),
        lambda text: b"\xef\xbb\xbf" + text.encode("latin-1"),
        lambda text: text.replace("\n", "\r").encode("latin-1"),
        lambda text: text.replace("a", "\x1b[2J\x00").encode("latin-1"),
        lambda text: text.replace("e", "\u202e\ud800").encode("utf-8", "surrogatepass"),
    )
    return ways[int(rng.integers(len(ways)))](data.decode("latin-1"))


def _word(data: bytes, rng: np.random.Generator) -> bytes:
    """Replace a value or a word by one of another type."""
    found = list(re.finditer(rb'"[^"\n]*"|\btrue\b|\bfalse\b|\b[A-Za-z]+\b', data[:100_000]))
    if not found:
        return _flip(data, rng)
    one = found[int(rng.integers(len(found)))]
    words = (
        *NUMBERS,
        "=cmd|' /C calc'!A0",
        "../../etc/passwd",
        "/dev/zero",
        "a" * 10_000,
        "\\u001b",
    )
    return data[: one.start()] + str(rng.choice(words)).encode() + data[one.end() :]


def _swap(data: bytes, rng: np.random.Generator) -> bytes:
    """Exchange two pieces of one length."""
    size = min(int(rng.choice([2, 8, 512])), max(len(data) // 4, 1))
    one, two = sorted(int(place) for place in rng.integers(0, max(len(data) - size, 1), 2))
    if two - one < size:
        return _flip(data, rng)
    parts = data[:one], data[two : two + size], data[one + size : two], data[one : one + size]
    return b"".join(parts) + data[two + size :]


def _head(data: bytes, rng: np.random.Generator) -> bytes:
    """Put a huge head before it, or into it."""
    at = int(rng.choice([0, 4, min(512, len(data))]))
    return data[:at] + bytes(rng.integers(0, 256, 8)) * 2**17 + data[at:]


def _ones(data: bytes, rng: np.random.Generator) -> bytes:
    """Set a number of the head to the largest or to zero: a count, an offset or a size."""
    size = int(rng.choice([2, 4, 8]))
    at = int(rng.integers(0, min(len(data), 2048)))
    value = [b"\xff" * size, b"\xff" * (size - 1) + b"\x7f", bytes(size)][int(rng.integers(3))]
    return data[:at] + value + data[at + size :]


def _pickle(data: bytes, rng: np.random.Generator) -> bytes:
    """Replace it by a pickle that leaves a file where it is read."""
    return b"cos\nsystem\n(S'touch unpickled'\ntR." + data[int(rng.integers(len(data))) :]


def _bomb(data: bytes, rng: np.random.Generator) -> bytes:
    """Replace a member of a ZIP archive by 160 MiB of one byte; elsewhere repeat the end."""
    if data[:2] != b"PK":
        return data + data[-64:] * 2**14
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w", 8) as new:
        members = old.namelist()
        swollen = members[int(rng.integers(len(members)))]
        for member in members:
            content = bytes([int(rng.integers(256))]) * (160 * 2**20) if member == swollen else b""
            new.writestr(member, content or old.read(member))
    return out.getvalue()


def strange(
    columns: Mapping[str, np.ndarray], rng: np.random.Generator
) -> tuple[str, dict[str, ArrayLike]]:
    """Replace one of the columns of an archive by another array; return what it is, and all."""
    name = str(rng.choice(list(columns)))
    column = columns[name]
    ways: Mapping[str, ArrayLike] = {
        "none": np.zeros(0),
        "scalar": 5.0,
        "no number": np.full_like(column, np.nan),
        "infinite": np.full_like(column, np.inf),
        "some infinite": np.where(np.arange(column.size) % 7, column, -np.inf),
        "huge": column * 1e300,
        "tiny": column * 1e-310,
        "constant": np.ones_like(column),
        "two columns": np.column_stack([column, column]),
        "deep": column.reshape(1, -1, 1),
        "complex": column + 1j,
        "truth": column > 0,
        "bytes": column.astype(np.int8),
        "integers": (column * 1e6).astype(np.int64),
        "text": column.astype(str),
        "one text": "a",
        "short": column[:-1],
        "short by half": column[: column.size // 2],
        "long": np.resize(column, 1_000_000),
        "reversed": column[::-1],
        "single": column.astype(np.float32),
        "half": column.astype(np.float16),
        "record": np.zeros(column.size, dtype=[("a", "f8"), ("b", "i4")]),
        "time": column.astype("datetime64[s]"),
        "objects": column.astype(object),
    }
    way = str(rng.choice(list(ways)))
    return f"{name} {way}", {**columns, name: ways[way]}
