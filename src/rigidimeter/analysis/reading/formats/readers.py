"""The formats that are read: one `Reader` each, in the list `READERS`.

To add a format, write a function that turns a file into a `Table` and put a `Reader` of it into the
list. Names of columns, the clock, gaps, labels and epochs are the same for all tables then. A
format that knows its own epochs, with a clock for each channel, returns epochs and notices instead.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from rigidimeter.analysis.reading.formats.arrow_file import read_arrow
from rigidimeter.analysis.reading.formats.bids_motion import is_bids_motion, read_bids_motion
from rigidimeter.analysis.reading.formats.biopac_file import read_biopac
from rigidimeter.analysis.reading.formats.c3d_file import read_c3d
from rigidimeter.analysis.reading.formats.hdf5_file import read_hdf5
from rigidimeter.analysis.reading.formats.mat_file import read_mat
from rigidimeter.analysis.reading.formats.neurophysiology_file import SUFFIXES, read_neurophysiology
from rigidimeter.analysis.reading.formats.npz_file import read_npz
from rigidimeter.analysis.reading.formats.nwb_file import read_nwb
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.spreadsheet import read_spreadsheet
from rigidimeter.analysis.reading.formats.stored_arrays import Columns
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table
from rigidimeter.analysis.reading.formats.tdms_file import read_tdms
from rigidimeter.analysis.reading.formats.text_head import Layout
from rigidimeter.analysis.reading.formats.text_table import read_text_recording
from rigidimeter.analysis.reading.formats.xdf_file import read_xdf, xdf_settings
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RECORDING_BYTES, open_regular, visible
from rigidimeter.core.records import Epoch, Notice
from rigidimeter.core.session import is_session, read_session, session_settings
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import STUDY_FILE

Epochs = tuple[list[Epoch], list[Notice]]
Found = TypeVar("Found")


@dataclass(frozen=True)
class Reader:
    """One format.

    Parameters
    ----------
    name : str
        What people call such a file, as in "MATLAB file".
    suffixes : tuple of str
        With the dot, in lower case.
    read : callable
        Turns a path into a `Table`, or into epochs and notices. It raises `UserError` with a
        sentence that begins with the path.
    of_text : bool
        `read` takes a `Layout` too: what the user says of the lines of a text or a sheet, and
        which of several tables is read.
    sniff : callable, optional
        Whether a path holds this format. It decides between readers of one suffix, and finds the
        reader of a path with an unknown suffix. A reader without it takes every file with one of
        its suffixes.
    settings : callable, optional
        Returns the settings with which a path was recorded, None where it does not say.
    made_by : str
        What makes such files. Where it is given, any exception of `read` means a damaged file.
    extra : str
        The extra of this package that `read` needs for some files, as in ``rigidimeter[matlab]``.
    about : str
        For the reference: where units, clocks and epochs come from, and what else is particular.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[..., Table | Epochs]
    sniff: Callable[[Path], bool] | None = None
    settings: Callable[[Path], Settings | None] | None = None
    made_by: str = ""
    extra: str = ""
    of_text: bool = False
    about: str = ""


READERS: list[Reader] = [
    Reader(
        "session folder",
        (),
        read_session,
        sniff=is_session,
        settings=session_settings,
        about="recorded by `run`, `console` or `simulate`; everything is known",
    ),
    Reader(
        "BIDS motion recording",
        (".tsv",),
        read_bids_motion,
        sniff=is_bids_motion,
        made_by="a program that writes BIDS-Motion",
        about="`…_motion.tsv` with `_channels.tsv` and `_motion.json` beside it, or a data set "
        "with one recording; a clock for each tracking system; events with a column `epoch` are "
        "epochs",
    ),
    Reader(
        "text table",
        (".csv", ".tsv", ".txt", ".asc", ".dat", ".lvm", ".sto", ".mot", ".gz"),
        read_text_recording,
        about="separated by comma, semicolon, tab, bar or blanks; decimal comma; UTF-8, UTF-16, "
        "Windows-1252; `#` begins a comment; names below a block of other lines, and a row of "
        "units; units and rates in the headers of LabVIEW, LabChart, Spike2, OpenSim, "
        "AcqKnowledge, Vicon Nexus, Qualisys and Biodex",
        of_text=True,
    ),
    Reader(
        "spreadsheet",
        (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"),
        read_spreadsheet,
        about="a sheet, read as text is; `--table` names one of several",
        made_by="Excel or LibreOffice",
        extra="excel",
        of_text=True,
    ),
    Reader(
        "NumPy archive",
        (".npz",),
        read_npz,
        made_by="numpy.savez",
        about="arrays by name; a single value `rate_hz`, `fs_hz`, `fs` or `sampling_rate_hz`; a "
        "matrix `data` with `names`, `columns`, `channels` or `labels`; nothing is unpickled",
    ),
    Reader(
        "MATLAB file",
        (".mat",),
        read_mat,
        about="version 4 to 7; tables, timetables, objects and 7.3 need the extra; units from "
        "`VariableUnits`; fields of structures have dotted names (`data.torque`); exports of "
        "LabChart, AcqKnowledge, Spike2 and ControlDesk, Simulink and `timeseries` with "
        "names, units and clocks",
        made_by="save in MATLAB",
        extra="matlab",
        of_text=True,
    ),
    Reader(
        "NWB file",
        (".nwb",),
        read_nwb,
        about="every time series with one value a sample, by its own clock, `conversion` and "
        "`offset`; trials or epochs, without those whose `excluded` is true",
        made_by="a program that writes NWB",
        extra="nwb",
    ),
    Reader(
        "XDF file",
        (".xdf", ".xdfz"),
        read_xdf,
        settings=xdf_settings,
        about="a clock for each stream; offsets applied and stamps straightened; streams of `run` "
        "give its epochs",
        made_by="LabRecorder",
        extra="xdf",
    ),
    Reader(
        "HDF5 file",
        (".h5", ".hdf5"),
        read_hdf5,
        made_by="h5py",
        extra="matlab",
        about="datasets of one dimension, in groups with dotted names; attributes `unit` or "
        "`units`, and `fs` or as in NumPy archives; a dataset with a `scale_factor` is not read",
    ),
    Reader(
        "TDMS file",
        (".tdms",),
        read_tdms,
        made_by="LabVIEW",
        extra="tdms",
        about="a clock for each waveform channel (`wf_increment`), units from `unit_string`",
    ),
    Reader(
        "C3D file",
        (".c3d",),
        read_c3d,
        made_by="a program of motion capture",
        extra="c3d",
        about="analogue channels, scaled, with their `UNITS`; no angle is computed from markers",
    ),
    Reader(
        "BIOPAC file",
        (".acq",),
        read_biopac,
        made_by="AcqKnowledge",
        extra="biopac",
        about="a clock and a unit for each channel",
    ),
    Reader(
        "electrophysiology file",
        SUFFIXES,
        read_neurophysiology,
        about="a clock and a unit for each channel; Plexon has millivolts, so give `--scale`; "
        "`.smrx` also needs sonpy, which has no wheel for Linux below Python 3.14 and was not "
        "tested: save as `.smr`",
        made_by="Spike2, pCLAMP, Central or Plexon",
        extra="neo",
    ),
    Reader(
        "Parquet or Arrow file",
        (".parquet", ".feather", ".arrow", ".arrows"),
        read_arrow,
        about="the unit of a field in its metadata under `unit`, or in its name; `virtual = true` "
        "in the metadata of a simulated recording",
        made_by="a program that writes Parquet or Arrow",
    ),
]
"""Every format. Of several readers for one path the first counts."""
_IGOR = "in Igor Pro save the waves as delimited text, with their names, and read the .txt file"
_WAYS = {
    ".npy": "it names no columns, so save them by name in Python: numpy.savez('recording.npz', "
    "time_s=..., torque_nm=..., angle_rad=...)",
    **dict.fromkeys((".itx", ".ibw", ".pxp"), _IGOR),
    **dict.fromkeys((".adicht", ".adibin"), "export it from LabChart as .mat or as text"),
    ".zip": "unpack it and read the files in it",
}
"""What helps with files of other types."""


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
    for reader in (*named, *(reader for reader in READERS if reader.sniff is not None)):
        if reader.sniff is None or reader.sniff(path):
            return reader
    known = _any_of(list(dict.fromkeys(s for reader in READERS for s in reader.suffixes)))
    if (path / STUDY_FILE).is_file():
        raise UserError(
            f"{path} is a study folder: compare its conditions with `rigidimeter compare {path}`, "
            "or give one of its session folders or recordings"
        )
    if path.is_dir():
        raise UserError(
            f"{path} is a folder without manifest.json, so it is not a session folder; give a "
            f"session folder or a {known} file"
        )
    if suffix in _WAYS:
        raise UserError(f"{path} is a {path.suffix} file, which is not read; {_WAYS[suffix]}")
    what = f"of type {path.suffix}" if path.suffix else "without a suffix"
    raise UserError(f"{path} is a file {what}; what can be read is {known}")


def read_recording(path: Path, options: ReadOptions) -> Epochs:
    """Read the epochs of a session folder or a file.

    Parameters
    ----------
    path : Path
    options : ReadOptions
        What a file does not say of itself; a format that knows its own epochs needs nothing of it.

    Returns
    -------
    epochs : list of Epoch
        In the order of the file; at least one of a table.
    notices : list of Notice
        What the user should know of them.

    Raises
    ------
    UserError
        If the path cannot be read as a recording; one sentence says why.
    """
    found = _read(path, _layout(options))
    return epochs_from_table(found, options) if isinstance(found, Table) else found


def settings_in_file(path: Path) -> Settings | None:
    """Return the settings with which a path was recorded; None where it does not say.

    Raises
    ------
    UserError
        If there is no reader of the path, or it is damaged.
    """
    reader = reader_of(path)
    if reader.settings is None:
        return None
    _check_file(path)
    return _called(reader, reader.settings, path)


def read_table(path: Path, options: ReadOptions | None = None) -> Table:
    """Read the columns of a file.

    Raises
    ------
    UserError
        If there is no such file, or none that can be read as a table.
    """
    found = read_content(path, options or ReadOptions())
    if not isinstance(found, Table):
        raise UserError(f"{path} is a {reader_of(path).name}, which holds epochs and no table")
    return found


def read_content(path: Path, options: ReadOptions) -> Table | Epochs:
    """Read the columns of a file, or the epochs and notices of a path that knows its own.

    Raises
    ------
    UserError
        If there is no such path, or it cannot be read.
    """
    return _read(path, _layout(options))


def formats_text() -> str:
    """Return the list of formats for help texts and messages."""
    shown = [
        f"{reader.name}s" + (f" ({', '.join(reader.suffixes)})" if reader.suffixes else "")
        for reader in READERS
    ]
    return _any_of(shown)


def _layout(options: ReadOptions) -> Layout:
    return Layout(options.skip_rows, tuple(options.names), options.table)


def _read(path: Path, layout: Layout) -> Table | Epochs:
    reader = reader_of(path)
    _check_file(path)

    def read(path: Path) -> Table | Epochs:
        return reader.read(path, layout) if reader.of_text else reader.read(path)

    found = _called(reader, read, path)
    if isinstance(found, Table) and isinstance(found.columns, Columns):
        columns = found.columns.refusing(functools.partial(_refusal, reader, path))
        return replace(found, columns=columns)
    return found


def _check_file(path: Path) -> None:
    """Refuse a pipe or a device, which a library would wait for, and an empty file."""
    if path.is_dir():
        return
    with open_regular(path, RECORDING_BYTES) as file:
        if not file.read(1):
            raise UserError(f"{path} is empty; a recording in a {path.suffix} file was expected")


def _called(reader: Reader, function: Callable[[Path], Found], path: Path) -> Found:
    """Call a function of a reader; what it raises becomes a sentence."""
    try:
        return function(path)
    except UserError:
        raise
    except ImportError as error:
        if not reader.extra:
            raise
        raise UserError(
            f"{path} is a {reader.name}, which needs one more package: "
            f"pip install 'rigidimeter[{reader.extra}]'"
        ) from error
    except Exception as error:
        raise _refusal(reader, path, error) from error


def _refusal(reader: Reader, path: Path, error: Exception) -> Exception:
    """Return what says that a file is damaged, where any exception means that."""
    if not reader.made_by or isinstance(error, MemoryError):
        return error
    reason = (str(error).strip().splitlines() or [""])[0][:120] or type(error).__name__
    return UserError(
        f"{path} is not a complete {reader.name} ({visible(reason)}); it must be made by "
        f"{reader.made_by}"
    )


def _any_of(names: list[str]) -> str:
    return " or ".join(filter(None, [", ".join(names[:-1]), names[-1]]))
