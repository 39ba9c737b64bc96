"""Check a MATLAB file of version 5 to 7 before scipy's compiled reader gets it.

That reader does not check type codes and sizes, and a wrong one can crash the process. A file is a
sequence of elements, each with a tag that gives its type and its size; a matrix is an element that
holds elements. Source: MathWorks, "MAT-File Format", 2019,
chapter 1.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import BinaryIO

from rigidimeter.core.files import CELLS, NESTING

_HEADER_BYTES = 128
_INT8, _INT32, _UINT32, _MATRIX, _COMPRESSED, _UTF8 = 1, 5, 6, 14, 15, 16
_NUMBERS = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13})
_TYPES = _NUMBERS | {_MATRIX, _UTF8, 17, 18}
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _LAST_PLAIN = 1, 2, 3, 4, 5, 15
_CLASS = 17  # such as a table: its values are in the last variable, which has no name
_COMPLEX = 0x0800
_OPAQUE = (_OBJECT, _SPARSE)


@dataclass(frozen=True)
class _Element:
    kind: int
    start: int
    stop: int


@dataclass(frozen=True)
class Variable:
    """A variable of a file.

    Attributes
    ----------
    name : str
    content : str
        ``numbers``, ``complex``, ``text or parts`` (text, cells and structures), ``objects`` (of a
        class, such as a table, or a structure with such) or ``other``.
    shape : tuple of int
    n_values : int
        Numbers and letters, those of its parts included.
    start : int
        Where its tag begins in the file.
    """

    name: str
    content: str
    shape: tuple[int, ...]
    n_values: int
    start: int = 0


def check_mat5(
    file: BinaryIO, file_bytes: int, expand: Callable[[int], None]
) -> list[Variable] | None:
    """Walk a file of version 5 to 7; files of version 4 have no tags and pass.

    Parameters
    ----------
    file : binary file
        At its beginning.
    file_bytes : int
        Its size.
    expand : callable
        Called with the size of each compressed variable before it is expanded; it may raise.

    Returns
    -------
    list of Variable or None
        None of a file of version 4.

    Raises
    ------
    ValueError
        If an element is not one, or does not end where the next begins.
    """
    header = file.read(_HEADER_BYTES)
    if len(header) < _HEADER_BYTES or 0 in header[:4]:
        return None
    order = {b"IM": "<", b"MI": ">"}.get(header[126:128])
    if order is None:
        raise ValueError("its header does not state a byte order")
    walk = _Walk(order)
    found = []
    while tag := file.read(8):
        start = file.tell() - len(tag)
        if len(tag) < 8:
            raise ValueError("it ends within the tag of an element")
        kind, size = struct.unpack(order + "II", tag)
        if size > file_bytes - file.tell():
            raise ValueError("it is cut short")
        data = file.read(size)
        if kind == _COMPRESSED:
            data = _expanded(order, data, expand)
            elements = walk.elements(data, 0, len(data))
            if len(elements) != 1 or elements[0].kind != _MATRIX:
                raise ValueError("a compressed variable is not a single matrix")
            variable = walk.matrix(data, elements[0], 1)
        elif kind == _MATRIX:
            variable = walk.matrix(data, _Element(kind, 0, size), 1)
        else:
            raise ValueError(f"a variable has the unknown type {kind}")
        found.append(replace(variable, start=start))
    return found


def _expanded(order: str, data: bytes, expand: Callable[[int], None]) -> bytes:
    """Expand a compressed variable, which must be as long as its own tag says."""
    stream = zlib.decompressobj()
    tag = stream.decompress(data, 8)
    if len(tag) < 8:
        raise ValueError("a compressed variable ends within its tag")
    size = struct.unpack(order + "II", tag)[1]
    expand(size)
    inner = tag + stream.decompress(stream.unconsumed_tail, size + 1)
    if not stream.eof or len(inner) != size + 8:
        raise ValueError("a compressed variable has another size than its tag says")
    return inner


class _Walk:
    """A walk through the matrices of a file; it ends where there are more than are read."""

    def __init__(self, order: str) -> None:
        self._order = order
        self._n_elements = 0
        self._n_values = 0
        self._n_objects = 0

    def elements(self, data: bytes, start: int, stop: int) -> list[_Element]:
        """Split a range of bytes into its elements, which must fill it."""
        found = []
        while start < stop:
            self._n_elements += 1
            if self._n_elements > 4 * CELLS:  # a cell of text has four
                raise ValueError(f"it holds more than {CELLS} cells or fields")
            if stop - start < 8:
                raise ValueError("a variable ends within the tag of an element")
            kind, size = struct.unpack_from(self._order + "II", data, start)
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

    def matrix(self, data: bytes, matrix: _Element, depth: int) -> Variable:
        """Check that a matrix holds the parts that its class asks for."""
        if matrix.start == matrix.stop:
            return Variable("", "other", (0,), 0)  # an empty cell or field
        if depth > NESTING:
            raise ValueError("its structures are nested too deeply")
        parts = self.elements(data, matrix.start, matrix.stop)
        if len(parts) < 3 or parts[0].kind != _UINT32 or parts[0].stop - parts[0].start != 8:
            raise ValueError("a variable has no flags")
        before, objects_before = self._n_values, self._n_objects
        (flags,) = struct.unpack_from(self._order + "I", data, parts[0].start)
        kind = flags & 0xFF
        for part in parts[1:]:
            if part.kind == _MATRIX:
                self.matrix(data, part, depth + 1)
        if not _CELL <= kind <= _LAST_PLAIN:
            return self._object(data, kind, parts)
        _, dims, name, *rest = parts
        shape = self._shape(data, dims, name)
        count = math.prod(shape)
        if kind == _CELL:
            right = len(rest) == count and all(part.kind == _MATRIX for part in rest)
        elif kind in (_STRUCT, _OBJECT):
            right = self._is_struct(data, rest[kind == _OBJECT :], count)
        elif kind == _CHAR:
            right = len(rest) == 1 and rest[0].kind != _MATRIX
        else:
            wanted = (2 if flags & _COMPLEX else 1) + (2 if kind == _SPARSE else 0)
            right = len(rest) == wanted and all(part.kind in _NUMBERS for part in rest)
        if not right:
            raise ValueError("a variable does not have the parts of its class")
        if kind not in (_CELL, _STRUCT, _OBJECT):
            self._n_values += count
        content = "complex" if flags & _COMPLEX else "numbers"
        if kind in _OPAQUE:
            content = "other"
        elif kind in (_CELL, _STRUCT, _CHAR):
            content = "text or parts"
        if self._n_objects > objects_before:
            content = "objects"
        text = data[name.start : name.stop].decode("latin-1")  # as scipy does
        return Variable(text, content, shape, self._n_values - before)

    def _object(self, data: bytes, kind: int, parts: list[_Element]) -> Variable:
        """Check an object of a class; a function is never a column, and read without its parts."""
        if kind != _CLASS:
            return Variable("", "other", (0,), 0)
        self._n_objects += 1
        _, name, *rest = parts
        if name.kind != _INT8 or [part.kind for part in rest] != [_INT8, _INT8, _MATRIX]:
            raise ValueError("an object does not have the parts of its class")
        text = data[name.start : name.stop].decode("latin-1")
        return Variable(text, "objects", (0,), 0)

    def _shape(self, data: bytes, dims: _Element, name: _Element) -> tuple[int, ...]:
        n_dims = (dims.stop - dims.start) // 4
        # Other programs than MATLAB write dimensions without sign and names in UTF-8.
        named = dims.kind in (_INT32, _UINT32) and name.kind in (_INT8, _UTF8)
        if not named or not 2 <= n_dims <= 32:
            raise ValueError("a variable has no dimensions or no name")
        shape = struct.unpack_from(f"{self._order}{n_dims}i", data, dims.start)
        if min(shape) < 0:
            raise ValueError("a variable has a negative dimension")
        return shape

    def _is_struct(self, data: bytes, rest: list[_Element], count: int) -> bool:
        if len(rest) < 2 or rest[0].kind != _INT32 or rest[0].stop - rest[0].start != 4:
            return False
        (length,) = struct.unpack_from(self._order + "i", data, rest[0].start)
        names_bytes = rest[1].stop - rest[1].start
        if length <= 0 or names_bytes % length or rest[1].kind != _INT8:
            return False
        fields = rest[2:]
        return len(fields) == count * (names_bytes // length) and all(
            part.kind == _MATRIX for part in fields
        )
