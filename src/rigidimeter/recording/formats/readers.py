"""One door to recordings that others made: the suffix of the file says how to read it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.csv_file import read_csv
from rigidimeter.recording.formats.mat_file import read_mat
from rigidimeter.recording.formats.npz_file import read_npz
from rigidimeter.recording.formats.table_epochs import ReadOptions, Table, epochs_from_table
from rigidimeter.records import Epoch, Notice

__all__ = ["READERS", "read_recording", "read_table"]

READERS: Mapping[str, Callable[[Path], Table]] = {
    ".csv": read_csv,
    ".tsv": read_csv,
    ".txt": read_csv,
    ".npz": read_npz,
    ".mat": read_mat,
}
"""What reads a file, by its suffix in lower case."""


def read_recording(path: Path, options: ReadOptions) -> tuple[list[Epoch], list[Notice]]:
    """Read the epochs of a file.

    Parameters
    ----------
    path : Path
        A text, NumPy or MATLAB file.
    options : ReadOptions
        What the file does not say of itself.

    Returns
    -------
    epochs : list of Epoch
        In the order of the file, at least one.
    notices : list of Notice
        What the user should know of them.

    Raises
    ------
    UserError
        If the file cannot be read as a recording; one sentence says why.
    """
    return epochs_from_table(read_table(path), options)


def read_table(path: Path) -> Table:
    """Read the columns of a file, chosen by its suffix.

    Raises
    ------
    UserError
        If there is no such file, or none that can be read.
    """
    known = f"{', '.join(list(READERS)[:-1])} or {list(READERS)[-1]}"
    if path.is_dir():
        raise UserError(
            f"{path} is a folder without manifest.json, so it is not a session folder; give a "
            f"session folder or a {known} file"
        )
    if not path.exists():
        raise UserError(f"{path}: there is no such file")
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        suffix = f"of type {path.suffix}" if path.suffix else "without a suffix"
        raise UserError(f"{path} is a file {suffix}; what can be read is {known}")
    if path.stat().st_size == 0:
        raise UserError(f"{path} is empty; a recording in a {path.suffix} file was expected")
    return reader(path)
