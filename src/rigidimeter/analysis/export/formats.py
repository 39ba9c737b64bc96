"""The formats that are written: one `Format` each, in the list `FORMATS`.

To add a format, write a function that writes one session, and put a `Format` of it into the list.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rigidimeter.analysis.export.bids import write_bids
from rigidimeter.analysis.export.exported_sessions import ExportedSession
from rigidimeter.analysis.export.names import stems
from rigidimeter.analysis.export.nwb import write_nwb
from rigidimeter.analysis.export.table_files import write_csv, write_mat, write_parquet
from rigidimeter.core.errors import UserError


@dataclass(frozen=True)
class Format:
    """One format.

    Parameters
    ----------
    name : str
        As `--to` takes it.
    title : str
        What people call it.
    write : callable
        Writes one session to a path that does not exist.
    suffix : str
        Of its files, with the dot; empty if a session becomes a folder.
    write_all : callable, optional
        Writes all sessions into a new folder, for a format that holds whole studies; without it
        each session is written by itself.
    extra : str
        The extra of this package that it needs, as in ``rigidimeter[nwb]``.
    """

    name: str
    title: str
    write: Callable[[ExportedSession, Path], None] | None = None
    suffix: str = ""
    write_all: Callable[[Sequence[ExportedSession], Path], None] | None = None
    extra: str = ""


FORMATS: list[Format] = [
    Format("nwb", "Neurodata Without Borders", write_nwb, ".nwb", extra="nwb"),
    Format("bids", "BIDS data set, motion", write_all=write_bids),
    Format("parquet", "Apache Parquet", write_parquet),
    Format("csv", "CSV tables", write_csv),
    Format("mat", "MATLAB file, version 5", write_mat, ".mat"),
]
"""Every format."""


def format_named(name: str) -> Format:
    """Return a format by its name.

    Raises
    ------
    UserError
        If there is none.
    """
    known = {each.name: each for each in FORMATS}
    if name not in known:
        raise UserError(f"--to {name}: there is no such format; known: {', '.join(known)}")
    return known[name]


def export_sessions(
    sessions: Sequence[ExportedSession],
    to: str,
    out: Path,
    *,
    overwrite: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> list[Path]:
    """Write sessions in a format.

    One session becomes `out` itself, several become files or folders in the folder `out`. All is
    written beside it first, so that `out` is never half of an export.

    Parameters
    ----------
    sessions : sequence of ExportedSession
        At least one.
    to : str
        The name of one of `FORMATS`.
    out : Path
    overwrite : bool
        Replace files of the same names; others in the folder stay.
    progress : callable
        Called with the share of the sessions that was written since, 1 in all.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    UserError
        If there is no such format, `out` exists or cannot be written, or a library is missing.
    """
    form = format_named(to)
    _check_place(form, out, overwrite=overwrite, several=len(sessions) > 1)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{out.name}.", dir=out.parent) as place:
            made = Path(place) / out.name
            _write(form, sessions, made, progress)
            return _moved(made, out)
    except ImportError as error:
        if not form.extra:
            raise
        raise UserError(
            f"--to {to} needs one more package: pip install 'rigidimeter[{form.extra}]'"
        ) from error
    except OSError as error:
        raise UserError(f"{out}: cannot be written ({error.strerror or error})") from None


def _check_place(form: Format, out: Path, *, overwrite: bool, several: bool) -> None:
    single = bool(form.suffix) and not several
    if single and out.suffix.lower() != form.suffix:
        raise UserError(
            f"--out {out}: the name of the file must end in {form.suffix}, such as "
            f"{out.with_suffix(form.suffix)}"
        )
    if single and out.is_dir():
        raise UserError(f"--out {out}: is a folder; name a new {form.suffix} file")
    if not single and out.exists() and not out.is_dir():
        raise UserError(f"--out {out}: is a file; name a new folder")
    held = out.exists() and (single or any(out.iterdir()))
    if held and not overwrite:
        what = "exists already" if single else "is not empty"
        raise UserError(f"--out {out}: {what}; name another, or say --overwrite to replace files")
    if (out / "manifest.json").exists() or (out.parent / "manifest.json").exists():
        raise UserError(f"--out {out}: lies in a session folder, which is never written to again")


def _write(
    form: Format,
    sessions: Sequence[ExportedSession],
    out: Path,
    progress: Callable[[float], None],
) -> None:
    if form.write_all is not None:
        form.write_all(sessions, out)
        progress(1.0)
        return
    if form.write is None:
        raise ValueError(f"format {form.name} has no function that writes")
    if len(sessions) == 1:
        form.write(sessions[0], out)
        progress(1.0)
        return
    out.mkdir()
    for session, stem in zip(sessions, stems(sessions), strict=True):
        form.write(session, out / f"{stem}{form.suffix}")
        progress(1.0 / len(sessions))


def _moved(made: Path, out: Path) -> list[Path]:
    """Move what was made to its place; files of the same name are replaced."""
    if made.is_file():
        made.replace(out)
        return [out]
    moved = []
    for file in sorted(each for each in made.rglob("*") if each.is_file()):
        place = out / file.relative_to(made)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(file, place)
        moved.append(place)
    return moved
