"""The formats that are read: one `Reader` each, in the list `READERS`.

To add a format, write a function that turns a file into `Columns` and put a `Reader` of it into the
list. Names of columns, the clock, gaps, labels and epochs are the same for all then.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from rigidimeter.analysis.reading_anew.columns import Columns
from rigidimeter.analysis.reading_anew.mapping import Mapping
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, open_regular, visible

_ROOM = __name__.rpartition(".")[0]


class Reader(NamedTuple):
    """One format.

    Attributes
    ----------
    name : str
        What people call such a file, as in "MATLAB file".
    suffixes : tuple of str
        With the dot, in lower case.
    function : str
        In this room, with its module: what turns a path into `Columns`, imported when such a file
        is read. It raises `UserError` with a sentence that begins with the path.
    takes_mapping : bool
        Whether the function takes the mapping too: what is said of the lines of a text or a sheet,
        and which of several tables is read.
    made_by : str
        What makes such files. Where it is given, any exception of `read` means a damaged file.
    extra : str
        The extra of this package that the function needs for some files.
    sniff : str
        A function that says whether a path holds this format. It decides between
        readers of one suffix, and finds the reader of a folder.
    """

    name: str
    suffixes: tuple[str, ...]
    function: str
    takes_mapping: bool = False
    made_by: str = ""
    extra: str = ""
    sniff: str = ""

    def holds(self, path: Path) -> bool:
        """Whether a path holds this format, as far as its reader tells."""
        return not self.sniff or bool(self._named(self.sniff)(path))

    def _named(self, function: str) -> Any:
        module, _, name = function.rpartition(".")
        return getattr(import_module(f"{_ROOM}.{module}"), name)

    def read(self, path: Path, said: Mapping) -> Columns:
        """Return the columns of a file; what a library raises becomes a sentence.

        Raises
        ------
        UserError
            If it cannot be read.
        """

        def called() -> Columns:
            function = self._named(self.function)
            found = function(path, said) if self.takes_mapping else function(path)
            assert isinstance(found, Columns)
            return found

        found: Columns = self.guarded(path, called)
        columns = {
            name: one._replace(read=partial(self.guarded, path, one.read))
            for name, one in found.columns.items()
        }
        return replace(found, columns=columns)

    def guarded(self, path: Path, function: Callable[[], Any]) -> Any:
        """Call a function on a file; what it raises becomes a sentence."""
        try:
            return function()
        except (UserError, MemoryError):
            raise
        except ImportError as error:
            if not self.extra:
                raise
            raise UserError(
                f"{path} is a {self.name}, which needs one more package: "
                f"pip install 'rigidimeter[{self.extra}]'"
            ) from error
        except Exception as error:
            if not self.made_by:
                raise
            reason = (str(error).strip().splitlines() or [""])[0][:120] or type(error).__name__
            raise UserError(
                f"{path} is not a complete {self.name} ({visible(reason)}); it must be made by "
                f"{self.made_by}"
            ) from error


READERS: tuple[Reader, ...] = (
    Reader(
        "BIDS motion recording",
        (".tsv",),
        "bids.read_bids_motion",
        sniff="bids.is_bids_motion",
        made_by="a program that writes BIDS-Motion",
    ),
    Reader(
        "text table",
        (".csv", ".tsv", ".txt", ".asc", ".dat", ".lvm", ".sto", ".mot", ".gz"),
        "text.body.read_text",
        takes_mapping=True,
    ),
    Reader("NumPy archive", (".npz",), "archives.read_npz", made_by="numpy.savez"),
    Reader(
        "MATLAB file",
        (".mat",),
        "matlab.read_mat",
        made_by="save in MATLAB",
        extra="matlab",
        takes_mapping=True,
    ),
    Reader("NWB file", (".nwb",), "nwb.read_nwb", made_by="a program that writes NWB", extra="nwb"),
    Reader("HDF5 file", (".h5", ".hdf5"), "hdf5.read_hdf5", made_by="h5py", extra="matlab"),
    Reader(
        "spreadsheet",
        (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"),
        "sheets.read_spreadsheet",
        made_by="Excel or LibreOffice",
        extra="excel",
        takes_mapping=True,
    ),
    Reader("XDF file", (".xdf", ".xdfz"), "xdf.read_xdf", made_by="LabRecorder", extra="xdf"),
    Reader("TDMS file", (".tdms",), "tdms.read_tdms", made_by="LabVIEW", extra="tdms"),
    Reader(
        "C3D file",
        (".c3d",),
        "instruments.read_c3d",
        made_by="a program of motion capture",
        extra="c3d",
    ),
    Reader(
        "electrophysiology file",
        (".smr", ".smrx", ".abf", ".plx", *(f".ns{k}" for k in range(1, 7))),
        "instruments.read_neurophysiology",
        made_by="Spike2, pCLAMP, Central or Plexon",
        extra="neo",
    ),
    Reader(
        "Parquet or Arrow file",
        (".parquet", ".feather", ".arrow", ".arrows"),
        "archives.read_arrow",
        made_by="a program that writes Parquet or Arrow",
    ),
)
"""Every format. Of several readers for one path the first counts."""
_IGOR = "in Igor Pro save the waves as delimited text, with their names, and read the .txt file"
# What helps with files of other types.
_WAYS = {
    ".npy": "it names no columns, so save them by name in Python: numpy.savez('recording.npz', "
    "time_s=..., torque_nm=..., angle_rad=...)",
    **dict.fromkeys((".itx", ".ibw", ".pxp"), _IGOR),
    **dict.fromkeys((".adicht", ".adibin"), "export it from LabChart as .mat or as text"),
    ".zip": "unpack it and read the files in it",
}


def reader_of(path: Path) -> Reader:
    """Return the reader of a path.

    Raises
    ------
    UserError
        If there is no such path, or no reader for it.
    """
    if not path.exists():
        raise UserError(f"{path}: there is no such file")
    suffix = path.suffix.lower()
    named = [reader for reader in READERS if suffix in reader.suffixes and not path.is_dir()]
    for reader in (*named, *(reader for reader in READERS if reader.sniff)):
        if reader.holds(path):
            return reader
    known = ", ".join(dict.fromkeys(s for reader in READERS for s in reader.suffixes))
    if path.is_dir():
        raise UserError(f"{path} is a folder without a recording; give a {known} file")
    if suffix in _WAYS:
        raise UserError(f"{path} is a {path.suffix} file, which is not read; {_WAYS[suffix]}")
    what = f"of type {path.suffix}" if path.suffix else "without a suffix"
    raise UserError(f"{path} is a file {what}; what can be read is {known}")


def columns_of(path: Path, said: Mapping) -> Columns:
    """Return the columns of a file of any known format.

    Parameters
    ----------
    path : Path
    said : Mapping
        Of it, what says how a file is opened.

    Raises
    ------
    UserError
        If it cannot be read; one sentence says why.
    """
    reader = reader_of(path)
    if not path.is_dir():
        # Not a pipe or a device, which a library would wait for; hashed here, and nowhere else.
        with open_regular(path, RECORDING_BYTES) as file:
            if not file.read(1):
                what = f"a recording in a {path.suffix} file was expected"
                raise UserError(f"{path} is empty; {what}")
    return reader.read(path, said)
