"""What commands do with studies: read and analyse them, keep what was concluded.

Loads the analysis of studies; a command imports it when it is called.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.recording import provenance
from rigidimeter.analysis.study import (
    StudyResult,
    analyse_study,
    estimate_study,
    keep,
    read_study,
    recording_result,
)
from rigidimeter.analysis.study.study_analysis import StudyRead
from rigidimeter.cli.inputs import Analysed, command_line
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import Recordings
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Notice
from rigidimeter.core.settings import load_settings
from rigidimeter.core.study_files import read_study_folder


def of_recording(read: Recording, analysis: Analysis) -> StudyResult:
    """Return what pages and tables show of a recording."""
    return recording_result(read, analysis, command_line())


def study_files(folder: Path, key: Path | None) -> tuple[Path, ...]:
    """Return the study's own files, which no other output may be written over."""
    tables = read_study_folder(folder, key).files.values()
    return folder, *tables, *(folder / "analysis").glob("*")


def read_study_inputs(
    folder: Path,
    recordings: Recordings,
    key: Path | None = None,
    pair: tuple[str | None, str | None] = (None, None),
    group: str | None = None,
) -> StudyRead:
    """Read a study folder with progress, as the options say."""
    chosen = load_settings(recordings.settings) if recordings.settings is not None else None
    with Meter("read", 1.0) as meter:
        read = read_study(
            folder,
            key=key,
            settings=chosen,
            method=recordings.method,
            pair=pair,
            group=group,
            progress=meter.advance,
        )
    return replace(read, settings=recordings.adjust(read.settings))


def estimate_study_inputs(read: StudyRead) -> tuple[Analysis, list[Notice]]:
    """Estimate the epochs of a study with progress, and nothing else; with all notices on it."""
    with Meter("estimate", 1.0) as meter:
        analysis, found = estimate_study(read, meter.advance)
    return analysis, [*read.notices, *found]


def analyse_study_folder(
    folder: Path,
    recordings: Recordings,
    key: Path | None = None,
    *,
    pair: tuple[str | None, str | None] = (None, None),
    group: str | None = None,
    seed: int = 1,
    resamples: int = 9999,
) -> tuple[StudyResult, Analysed]:
    """Read and analyse a study folder, and keep the analysis in it.

    That of one group is not kept: what changed since the last one would be the other groups.

    Raises
    ------
    UserError
        If there is nothing to analyse.
    """
    read = read_study_inputs(folder, recordings, key, pair, group)
    with Meter("study", 1.0) as meter:
        result = analyse_study(read, seed=seed, resamples=resamples, progress=meter.advance)
    changes, not_kept = [], ""
    try:
        changes = keep(read, result) if group is None else []
    except UserError as error:
        not_kept = str(error)
    # It comes from the tables and the sessions that count.
    files, digests = read.folder.files, read.folder.digests
    tables = [path for name, path in files.items() if name != "key"]
    sessions = [folder / session.path for session in result.sessions]
    known = {path: digests[name] for name, path in files.items()}
    known |= {folder / name: digest for name, digest in read.gathered.digests.items()}
    facts = provenance((*tables, *sessions), known, result.settings, command_line())
    result = replace(result, changes=tuple(changes), provenance=facts)
    bad = any(notice.level == "error" for notice in result.notices)
    # The screen says what could not be tested.
    bad |= any(c.paired and c.test is None and bool(c.remark) for c in result.comparisons)
    return result, Analysed(result.analysis, result.notices, bad, not_kept)
