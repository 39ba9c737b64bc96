"""Check a MATLAB file of version 4 before scipy reads it.

A variable is a header of five whole numbers, its name and its values. scipy asks for as much memory
as a header states before it reads, so a damaged one could ask for all that there is. Source:
MathWorks, "MAT-File Format", 2019, chapter 2.
"""

from __future__ import annotations

import struct
from typing import BinaryIO

_HEADER_BYTES = 20
_VALUE_BYTES = (8, 4, 4, 2, 2, 1)
_SPARSE = 2
"""The last of the classes: numbers, text, sparse."""
_HIGHEST_TYPE = 5000
"""Byte order in thousands, nothing in hundreds, type of the values in tens, class in ones."""


def check_mat4(file: BinaryIO, file_bytes: int) -> int:
    """Walk a file of version 4; return how many variables it holds.

    Parameters
    ----------
    file : binary file
    file_bytes : int
        Its size.

    Raises
    ------
    ValueError
        If a header is not one, or states more than the file holds.
    """
    file.seek(0)
    first = file.read(4)
    order = "<" if len(first) == 4 and 0 <= struct.unpack("<i", first)[0] <= _HIGHEST_TYPE else ">"
    count = start = 0
    while start < file_bytes:
        file.seek(start)
        header = file.read(_HEADER_BYTES)
        if len(header) < _HEADER_BYTES:
            raise ValueError("it ends within the header of a variable")
        size = _size(*struct.unpack(f"{order}5i", header))
        start += _HEADER_BYTES + size
        if start > file_bytes:
            raise ValueError(f"it is cut short: a variable states {size} bytes")
        count += 1
    return count


def _size(kind: int, rows: int, columns: int, imaginary: int, name_bytes: int) -> int:
    """Return the bytes of a variable's name and values."""
    machine, values, content = kind // 1000, kind % 100 // 10, kind % 10
    known = machine in (0, 1) and kind % 1000 < 100 and values < len(_VALUE_BYTES)
    if not known or content > _SPARSE:
        raise ValueError(f"a variable has the unknown type {kind}")
    if min(rows, columns) < 0 or imaginary not in (0, 1) or name_bytes < 1:
        raise ValueError("a variable has a negative size, or is neither real nor complex")
    parts = 2 if imaginary and content != _SPARSE else 1
    return name_bytes + parts * rows * columns * _VALUE_BYTES[values]
