"""From what was read and computed to a page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.recording import Recording
    from rigidimeter.records import Analysis
    from rigidimeter.study import StudyResult

__all__ = ["make_report", "write_page"]


def make_report(title: str, recording: Recording, analysis: Analysis, out: Path) -> Path:
    """Compare the first two conditions and write the report; return the page's path.

    Raises
    ------
    UserError
        If the folder cannot be written.
    """
    from rigidimeter.cli.provenance import provenance
    from rigidimeter.study import compare_analysis

    made = replace(
        compare_analysis(analysis, title=title),
        settings=recording.settings,
        epochs=recording.epochs,
        notices=recording.notices,
        provenance=provenance(recording.paths, recording.settings),
    )
    return write_page(made, out)


def write_page(study: StudyResult, out: Path) -> Path:
    """Write the report of a study with progress; return the page's path.

    Raises
    ------
    UserError
        If the folder cannot be written.
    """
    from rigidimeter.cli.progress import Meter
    from rigidimeter.reporting import write_report

    try:
        with Meter("report", 1.0) as meter:
            return write_report(study, out, meter.reach)
    except OSError as error:
        raise UserError(
            f"{out}: the report cannot be written ({error.strerror or error})"
        ) from None
