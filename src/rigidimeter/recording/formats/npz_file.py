"""NumPy archives: named arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.arrays import first_line, table_of_arrays
from rigidimeter.recording.formats.columns import Table

__all__ = ["read_npz"]


def read_npz(path: Path) -> Table:
    """Read a NumPy archive (``numpy.savez``), without unpickling anything.

    Raises
    ------
    UserError
        If it is not an archive, is damaged, or holds Python objects.
    """
    source = str(path)
    try:
        with path.open("rb") as file:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise UserError(
                    f"{source} holds a single unnamed array; save the columns by name, with "
                    "numpy.savez"
                )
            entries = {name: _entry(source, archive, name) for name in archive.files}
    except UserError:
        raise
    except FileNotFoundError:
        raise UserError(f"{source} cannot be read (no such file)") from None
    except Exception as error:  # a damaged archive fails in any of zipfile, zlib and numpy
        raise UserError(
            f"{source} is not a complete NumPy archive ({first_line(error)}); it must be made by "
            "numpy.savez"
        ) from error
    return table_of_arrays(source, entries)


def _entry(source: str, archive: Mapping[str, Any], name: str) -> NDArray[Any]:
    try:
        return np.asarray(archive[name])
    except ValueError as error:
        if "allow_pickle" not in str(error):
            raise
        raise UserError(
            f"{source}: {name} holds Python objects, which are not read because they could run "
            "code; save it as an array of numbers or of text"
        ) from None
