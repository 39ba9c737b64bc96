"""NumPy archives: named arrays."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.table import Table, table_of_arrays


def read_npz(path: Path) -> Table:
    """Read a NumPy archive (``numpy.savez``), without unpickling anything.

    Raises
    ------
    UserError
        If it holds a single array, or Python objects.
    Exception
        Whatever zipfile, zlib and NumPy raise on a damaged archive.
    """
    entries = {}
    with path.open("rb") as file:
        archive = np.load(file, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise UserError(
                f"{path} holds a single unnamed array; save the columns by name, with numpy.savez"
            )
        for name in archive.files:
            try:
                entries[name] = np.asarray(archive[name])
            except ValueError as error:
                if "allow_pickle" not in str(error):
                    raise
                raise UserError(
                    f"{path}: {name} holds Python objects, which are not read because they could "
                    "run code; save it as an array of numbers or of text"
                ) from None
    return table_of_arrays(str(path), entries)
