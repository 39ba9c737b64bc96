"""What commands do with recordings and studies: read and analyse them, say what was wrong.

Loads the analysis; a command imports it when it is called.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from rigidimeter.analysis.estimation import method_names, no_such_method
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.study import (
    StudyResult,
    analyse_study,
    estimate,
    estimate_study,
    keep,
    provenance,
    read_study,
    recording_result,
)
from rigidimeter.analysis.study.study_analysis import StudyRead
from rigidimeter.cli.output import echo, say
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import Recordings
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Notice
from rigidimeter.core.settings import load_settings
from rigidimeter.core.study_files import STUDY_FILE, is_study, read_study_folder

_OF_STUDIES_TOO = ("paths", "method", "band_hz", "controller", "keep_active", "settings")
"""Fields of `Recordings` that do not say how to read a single recording."""


class Analysed(NamedTuple):
    """What was analysed, and what is wrong with it.

    Attributes
    ----------
    result : StudyResult
    notices : sequence of Notice
        What is still to be said.
    bad : bool
        Whether an input was.
    not_kept : str
        Why the analysis was not kept in the folder of its study, if it was not.
    """

    result: StudyResult
    notices: Sequence[Notice]
    bad: bool
    not_kept: str = ""

    def say(self) -> int:
        """Say what is wrong, after the result was shown; return the exit status."""
        say(self.notices)
        outcomes = [one.outcome for one in self.result.analysis.results]
        none_counts = bool(outcomes) and not any(outcome.included for outcome in outcomes)
        failed = [one for one in self.result.analysis.results if one.outcome.kind == "failed"]
        for one in failed:
            echo(f"error: {one.source}, epoch {one.epoch}: {one.outcome.reason}", err=True)
        if none_counts and len(failed) < len(outcomes):
            why = next(outcome.reason for outcome in outcomes if outcome.kind == "excluded")
            echo(
                f"error: no epoch counts, so there is no estimate to use. The first: {why}",
                err=True,
            )
        if self.not_kept:
            echo(f"error: the analysis is not stored: {self.not_kept}", err=True)
        return int(self.bad or bool(failed) or none_counts or bool(self.not_kept))


def analyse_recordings(recordings: Recordings) -> tuple[Recording, Analysed]:
    """Read, fit and score recordings with progress, and say what is wrong with the inputs.

    Raises
    ------
    UserError
        If there is no such method, an option is wrong, or no input can be read.
    """
    read = recordings.read()
    say(read.notices)
    if recordings.method not in method_names():
        raise UserError(f"--method {recordings.method}: {no_such_method(recordings.method)}")
    with Meter("estimate", 1.0) as meter:
        analysis = estimate(read, recordings.method, progress=meter.advance)
    result = recording_result(read, analysis, command_line())
    return read, Analysed(result, (), read.failed)


def command_line() -> str:
    """Return the command as it could be given again."""
    return shlex.join(["rigidimeter", *sys.argv[1:]])


def study_of(recordings: Recordings, key: Path | None) -> Path | None:
    """Return the study folder among the inputs; None if there is none.

    Raises
    ------
    UserError
        If a study folder is named beside other inputs, or an option does not go with what is named.
    """
    studies = [path for path in recordings.paths if is_study(path)]
    if not studies:
        if key is not None:
            raise UserError(
                f"--key {key}: is for a study folder, but {recordings.paths[0]} is not one: it "
                f"has no {STUDY_FILE}"
            )
        return None
    if len(recordings.paths) > 1:
        raise UserError(
            f"{studies[0]}: is a study folder and names its own recordings; give it alone, or add "
            "the other recordings to its sessions.csv"
        )
    for name, given in vars(recordings).items():
        if given and name not in _OF_STUDIES_TOO:
            raise UserError(
                f"--{name.replace('_', '-')}: is for single recordings; those of a study folder "
                "are session folders or files that a mapping in study.toml describes"
            )
    return studies[0]


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
) -> Analysed:
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
    return Analysed(result, result.notices, bad, not_kept)
