"""`report`: from a result, an analysis or recordings to a written report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

from rigidimeter.analysis.reading import Recording, read
from rigidimeter.analysis.recording import estimate
from rigidimeter.analysis.report.page import source_names, write_report
from rigidimeter.analysis.report.report_folder import (
    INPUTS,
    inputs_seen_from,
    joined_names,
    why_not_own,
)
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.study import (
    StudyResult,
    analyse,
    analysis_study,
    conclude_study,
    load_study,
    prepare_study,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis
from rigidimeter.core.study_files import is_study

TITLE = "Joint rigidity"

AnyPath = str | PathLike[str]


def report(
    result: StudyResult | Shown | Analysis | Recording | AnyPath | Sequence[AnyPath],
    out: AnyPath,
    title: str | None = None,
    *,
    inputs: Sequence[AnyPath] = (),
    overwrite: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> Path:
    """Write a report: one HTML page that needs no other file, its tables and its figures.

    Parameters
    ----------
    result : StudyResult, Analysis, Recording, path or sequence of paths
        What `compare`, `estimate` or `read` returned; or a study folder, session folders and files,
        which are read and analysed. The recordings of a compared study folder are read again, for
        the figures of the recorded signals; estimates alone have none.
    out : path
        The folder; made if it does not exist. An older report of the same inputs is replaced.
    title : str, optional
        Default: the title of the study, else "Joint rigidity".
    inputs : sequence of paths
        What `result` was read from, if it is a result: the older report of the same is replaced.
        Default: the names of its recordings.
    overwrite : bool
        Write also into a folder with other files, or over the report of something else.
    progress : callable
        Takes the share of the page that is done, from 0 to 1.

    Returns
    -------
    Path
        Of the page, ``OUT/report.html``.

    Raises
    ------
    UserError
        If something cannot be read, the folder cannot be written, it holds other files, or a
        study folder has changed since it was compared.

    Examples
    --------
    >>> import pandas as pd, rigidimeter as rm
    >>> table = pd.DataFrame({"state": ["OFF", "ON"] * 6, "k": [1.8, 1.4, 1.7, 1.5] * 3})
    >>> rm.report(rm.compare(table, value="k", by="state"), "report").name
    'report.html'
    """
    folder = Path(out)
    if isinstance(result, (str, PathLike)):
        inputs = [result]
    elif not inputs and isinstance(result, Recording):
        inputs = result.paths
    elif not inputs and isinstance(result, Sequence):
        inputs = [one for one in result if isinstance(one, (str, PathLike))]
    paths, names = [Path(one) for one in inputs], ""
    if paths:  # before anything is computed
        _require_own(folder, names := inputs_seen_from(folder, paths), overwrite)
    shown = _shown(result)
    if not paths:
        _require_own(folder, names := joined_names(source_names(shown)), overwrite)
    facts = {**shown.provenance, INPUTS: names}
    called = title or shown.title or shown.study.title or TITLE
    shown = replace(shown, title=called, provenance=facts)
    try:
        return write_report(shown, folder, progress)
    except OSError as error:
        raise UserError(
            f"{out}: the report cannot be written ({error.strerror or error})"
        ) from None


def _require_own(out: Path, names: str, overwrite: bool) -> None:
    if not overwrite and (why := why_not_own(out, names)):
        raise UserError(f"{out}: {why}; name another folder, or write with overwrite=True")


def _shown(
    result: StudyResult | Shown | Analysis | Recording | AnyPath | Sequence[AnyPath],
) -> Shown:
    if isinstance(result, Shown):
        return result
    if isinstance(result, StudyResult):
        return Shown.of_result(result)
    if isinstance(result, Analysis):
        return Shown(conclude_study(analysis_study(result), resamples=0))
    if isinstance(result, Recording):
        return Shown.of_recording(result, estimate(result))
    if not isinstance(result, (str, PathLike, Sequence)):
        raise UserError(
            "report takes what compare, estimate or read returned, or paths; not something of type "
            f"{type(result).__name__}"
        )
    paths = [Path(result)] if isinstance(result, (str, PathLike)) else [Path(one) for one in result]
    if len(paths) == 1 and is_study(paths[0]):
        loaded = load_study(paths[0])
        prepared = prepare_study(loaded)
        return Shown.of_study(conclude_study(analyse(loaded, prepared)), loaded, prepared)
    return _shown(read(paths))
