"""`report`: from a result, an analysis or recordings to a written report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

from rigidimeter.analysis.reading import Recording, read
from rigidimeter.analysis.report.page import write_report
from rigidimeter.analysis.study import (
    StudyResult,
    compare,
    compare_analysis,
    estimate,
    recording_result,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis
from rigidimeter.core.study_files import is_study

TITLE = "Joint rigidity"

AnyPath = str | PathLike[str]


def report(
    result: StudyResult | Analysis | Recording | AnyPath | Sequence[AnyPath],
    out: AnyPath,
    title: str | None = None,
    *,
    progress: Callable[[float], None] = lambda _: None,
) -> Path:
    """Write a report: one HTML page that needs no other file, its tables and its figures.

    Parameters
    ----------
    result : StudyResult, Analysis, Recording, path or sequence of paths
        What `compare`, `estimate` or `read` returned; or a study folder, session folders and files,
        which are read and analysed. Estimates alone have no figures of the recorded signals.
    out : path
        The folder; made if it does not exist. Files of the same names are replaced.
    title : str, optional
        Default: the title of the study, else "Joint rigidity".
    progress : callable
        Takes the share of the page that is done, from 0 to 1.

    Returns
    -------
    Path
        Of the page, ``OUT/report.html``.

    Raises
    ------
    UserError
        If something cannot be read, or the folder cannot be written.
    """
    shown = _result(result)
    shown = replace(shown, title=title or shown.title or TITLE)
    try:
        return write_report(shown, Path(out), progress)
    except OSError as error:
        raise UserError(
            f"{out}: the report cannot be written ({error.strerror or error})"
        ) from None


def _result(
    result: StudyResult | Analysis | Recording | AnyPath | Sequence[AnyPath],
) -> StudyResult:
    if isinstance(result, StudyResult):
        return result
    if isinstance(result, Analysis):
        return compare_analysis(result, resamples=0)
    if isinstance(result, Recording):
        return recording_result(result, estimate(result.epochs, settings=result.settings))
    if not isinstance(result, (str, PathLike, Sequence)):
        raise UserError(
            "report takes what compare, estimate or read returned, or paths; not something of type "
            f"{type(result).__name__}"
        )
    paths = [Path(result)] if isinstance(result, (str, PathLike)) else [Path(one) for one in result]
    if len(paths) == 1 and is_study(paths[0]):
        return compare(paths[0])
    return _result(read(paths))
