"""Check a MATLAB file of version 5 to 7 before scipy's compiled reader gets it.

That reader does not check type codes and sizes, and a wrong one can crash the process. A file is a
sequence of elements, each with a tag that gives its type and its size; a matrix is an element that
holds elements. Source: MathWorks, "MAT-File Format", 2019,
chapter 1.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

_HEADER_BYTES = 128
_INT8, _INT32, _UINT32, _MATRIX, _COMPRESSED, _UTF8 = 1, 5, 6, 14, 15, 16
_NUMBERS = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13})
_TYPES = _NUMBERS | {_MATRIX, _UTF8, 17, 18}
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _LAST_PLAIN = 1, 2, 3, 4, 5, 15
_COMPLEX = 0x0800
_DEEPEST = 100


@dataclass(frozen=True)
class _Element:
    kind: int
    start: int
    stop: int


def check_mat5(data: bytes) -> None:
    """Walk a file of version 5 to 7; files of version 4 have no tags and pass.

    Raises
    ------
    ValueError
        If an element is not one, or does not end where the next begins.
    """
    if len(data) < _HEADER_BYTES or 0 in data[:4]:
        return
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None:
        raise ValueError("its header does not state a byte order")
    at = _HEADER_BYTES
    while at < len(data):
        if len(data) - at < 8:
            raise ValueError("it ends within the tag of an element")
        kind, size = struct.unpack_from(order + "II", data, at)
        at += 8
        if size > len(data) - at:
            raise ValueError("it is cut short")
        if kind == _COMPRESSED:
            inner = zlib.decompress(data[at : at + size])
            elements = _elements(order, inner, 0, len(inner))
            if len(elements) != 1 or elements[0].kind != _MATRIX:
                raise ValueError("a compressed variable is not a single matrix")
            _check_matrix(order, inner, elements[0], 1)
        elif kind == _MATRIX:
            _check_matrix(order, data, _Element(kind, at, at + size), 1)
        else:
            raise ValueError(f"a variable has the unknown type {kind}")
        at += size


def _elements(order: str, data: bytes, start: int, stop: int) -> list[_Element]:
    """Split a range of bytes into its elements, which must fill it."""
    found = []
    while start < stop:
        if stop - start < 8:
            raise ValueError("a variable ends within the tag of an element")
        kind, size = struct.unpack_from(order + "II", data, start)
        if kind >> 16:  # up to four bytes of data share the eight of the tag
            kind, size, begin, after = kind & 0xFFFF, kind >> 16, start + 4, start + 8
            if size > 4:
                raise ValueError(f"a short element claims {size} bytes")
        else:
            begin = start + 8
            after = begin + size + (-size % 8)
        if kind not in _TYPES or begin + size > stop:
            raise ValueError(f"an element of type {kind} and {size} bytes cannot be there")
        found.append(_Element(kind, begin, begin + size))
        start = after
    return found


def _check_matrix(order: str, data: bytes, matrix: _Element, depth: int) -> None:
    """Check that a matrix holds the parts that its class asks for."""
    if matrix.start == matrix.stop:
        return  # an empty cell or field
    if depth > _DEEPEST:
        raise ValueError("its structures are nested too deeply")
    parts = _elements(order, data, matrix.start, matrix.stop)
    if len(parts) < 3 or parts[0].kind != _UINT32 or parts[0].stop - parts[0].start != 8:
        raise ValueError("a variable has no flags")
    (flags,) = struct.unpack_from(order + "I", data, parts[0].start)
    kind = flags & 0xFF
    for part in parts[1:]:
        if part.kind == _MATRIX:
            _check_matrix(order, data, part, depth + 1)
    if not _CELL <= kind <= _LAST_PLAIN:
        return  # classes and functions: never a column, and read without their parts
    _, dims, name, *rest = parts
    n_dims = (dims.stop - dims.start) // 4
    # Other programs than MATLAB write dimensions without sign and names in UTF-8.
    named = dims.kind in (_INT32, _UINT32) and name.kind in (_INT8, _UTF8)
    if not named or not 2 <= n_dims <= 32:
        raise ValueError("a variable has no dimensions or no name")
    count = 1
    for length in struct.unpack_from(f"{order}{n_dims}i", data, dims.start):
        if length < 0:
            raise ValueError("a variable has a negative dimension")
        count *= length
    parts_of_number = 2 if flags & _COMPLEX else 1
    if kind == _CELL:
        right = len(rest) == count and all(part.kind == _MATRIX for part in rest)
    elif kind in (_STRUCT, _OBJECT):
        right = _is_struct(order, data, rest[kind == _OBJECT :], count)
    elif kind == _CHAR:
        right = len(rest) == 1 and rest[0].kind != _MATRIX
    else:
        wanted = parts_of_number + (2 if kind == _SPARSE else 0)
        right = len(rest) == wanted and all(part.kind in _NUMBERS for part in rest)
    if not right:
        raise ValueError("a variable does not have the parts of its class")


def _is_struct(order: str, data: bytes, rest: list[_Element], count: int) -> bool:
    if len(rest) < 2 or rest[0].kind != _INT32 or rest[0].stop - rest[0].start != 4:
        return False
    (length,) = struct.unpack_from(order + "i", data, rest[0].start)
    names_bytes = rest[1].stop - rest[1].start
    if length <= 0 or names_bytes % length or rest[1].kind != _INT8:
        return False
    fields = rest[2:]
    return len(fields) == count * (names_bytes // length) and all(
        part.kind == _MATRIX for part in fields
    )
