"""NumPy archives: named arrays."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.mat_channels import table_of_variables
from rigidimeter.analysis.reading.formats.stored_arrays import Expansion, Stored, check_count
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, open_regular


def read_npz(path: Path) -> Table:
    """Read a NumPy archive (``numpy.savez``), without unpickling anything.

    The directory of the archive and the header of every array are read first, and of the arrays
    only those that are used.

    Raises
    ------
    UserError
        If it holds a single array, or Python objects, or more than a recording does.
    Exception
        Whatever zipfile, zlib and NumPy raise on a damaged archive.
    """
    with open_regular(path, RECORDING_BYTES) as file:
        if file.read(6) == np.lib.format.MAGIC_PREFIX:
            raise UserError(
                f"{path} holds a single unnamed array; save the columns by name, with numpy.savez"
            )
        with zipfile.ZipFile(file) as archive:
            members = archive.infolist()
            check_count(path, len(members))
            expansion = Expansion(path, file.seek(0, 2))
            entries = {
                member.filename.removesuffix(".npy"): _stored(path, archive, member, expansion)
                for member in members
            }
    return table_of_variables(str(path), entries)


def _stored(
    path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, expansion: Expansion
) -> Stored:
    name = member.filename.removesuffix(".npy")
    if name == member.filename:  # of another program
        return Stored.of(np.empty(0, dtype="V1"))
    with archive.open(member) as file:
        shape, dtype, start = _header(file)
    stored = Stored(dtype, shape, lambda: _read(path, member, name, expansion))
    if dtype.hasobject:
        raise UserError(
            f"{path}: {name} holds Python objects, which are not read because they could run "
            "code; save it as an array of numbers or of text"
        )
    # NumPy makes room for the whole array before it reads its first value.
    if start + stored.size * dtype.itemsize != member.file_size:
        raise ValueError(f"{name} has another size than its header says")
    return stored


def _header(file: Any) -> tuple[tuple[int, ...], np.dtype[Any], int]:
    """Return shape, type and first byte of the data of an array of NumPy's format."""
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(file)
    else:
        shape, _, dtype = np.lib.format.read_array_header_2_0(file)
    if any(length < 0 for length in shape):
        raise ValueError("an array has a negative length")
    return shape, dtype, file.tell()


def _read(path: Path, member: zipfile.ZipInfo, name: str, expansion: Expansion) -> NDArray[Any]:
    expansion.take(name, member.file_size)
    with (
        open_regular(path, RECORDING_BYTES) as file,
        zipfile.ZipFile(file) as archive,
        archive.open(member) as entry,
    ):
        return np.asarray(np.lib.format.read_array(entry, allow_pickle=False))
