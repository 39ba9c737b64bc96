"""What commands do with recordings: read and estimate them, say what was wrong.

Loads the estimation; a command imports it when it is called.
"""

from __future__ import annotations

import math
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rigidimeter.analysis.estimation import method_names, no_such_method
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.recording import estimate
from rigidimeter.cli.output import echo, say
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import Recordings
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Notice
from rigidimeter.core.study_files import STUDY_FILE, is_study

_OF_STUDIES_TOO = ("paths", "method", "band_hz", "controller", "keep_active", "settings")
"""Fields of `Recordings` that do not say how to read a single recording."""


class Analysed(NamedTuple):
    """What was analysed, and what is wrong with it.

    Attributes
    ----------
    analysis : Analysis
    notices : sequence of Notice
        What is still to be said.
    bad : bool
        Whether an input was.
    not_kept : str
        Why the analysis was not kept in the folder of its study, if it was not.
    """

    analysis: Analysis = Analysis("", (), (), math.nan, ())
    notices: Sequence[Notice] = ()
    bad: bool = False
    not_kept: str = ""

    def say(self) -> int:
        """Say what is wrong, after the result was shown; return the exit status."""
        say(self.notices)
        outcomes = [one.outcome for one in self.analysis.results]
        none_counts = bool(outcomes) and not any(outcome.included for outcome in outcomes)
        failed = [one for one in self.analysis.results if one.outcome.kind == "failed"]
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
    return read, Analysed(analysis, bad=read.failed)


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
