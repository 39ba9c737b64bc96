"""What commands do with studies: read and analyse them, keep what was concluded.

Loads the analysis of studies; a command imports it when it is called.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rigidimeter.analysis.recording import study_provenance
from rigidimeter.analysis.report import Shown
from rigidimeter.analysis.study import (
    TESTS_SHARE,
    Loaded,
    analyse,
    conclude_study,
    estimate_study,
    keep,
    kept_study,
    load_study,
    prepare_study,
)
from rigidimeter.cli.inputs import Analysed, command_line
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import Recordings
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Notice
from rigidimeter.core.settings import load_settings
from rigidimeter.core.study_files import read_study_folder

Pair = tuple[str | None, str | None]

_PREPARED_SHARE = 0.2
"""Of the work on a study: what its epochs take before they are estimated."""


def study_files(folder: Path, key: Path | None) -> tuple[Path, ...]:
    """Return the study's own files, which no other output may be written over."""
    tables = read_study_folder(folder, key).files.values()
    return folder, *tables, *(folder / "analysis").glob("*")


def read_study_inputs(
    folder: Path,
    recordings: Recordings,
    key: Path | None = None,
    pair: Pair = (None, None),
    group: str | None = None,
) -> Loaded:
    """Read a study folder with progress, as the options say."""
    asked = _asked(recordings, key, pair)
    with Meter("read", 1.0) as meter:
        loaded = load_study(folder, **asked, group=group, progress=meter.advance)
    return replace(loaded, settings=recordings.adjust(loaded.settings))


def _asked(recordings: Recordings, key: Path | None, pair: Pair) -> dict[str, Any]:
    chosen = load_settings(recordings.settings) if recordings.settings is not None else None
    return {"key": key, "settings": chosen, "method": recordings.method, "pair": pair}


def estimate_study_inputs(loaded: Loaded) -> tuple[Analysis, list[Notice]]:
    """Estimate the epochs of a study with progress, and nothing else; with all notices on it."""
    with Meter("estimate", 1.0) as meter:
        analysis, found = estimate_study(loaded, meter.advance)
    return analysis, [*loaded.notices, *found]


def analyse_study_folder(
    folder: Path,
    recordings: Recordings,
    key: Path | None = None,
    *,
    pair: Pair = (None, None),
    group: str | None = None,
    seed: int = 1,
    resamples: int = 9999,
    recordings_shown: bool = True,
) -> tuple[Shown, Analysed]:
    """Read and analyse a study folder, and keep the analysis in it.

    That of one group is not kept: what changed since the last one would be the other groups. Where
    no recording is shown, a study in which nothing has changed is not analysed again.

    Raises
    ------
    UserError
        If there is nothing to analyse.
    """
    before = None
    if group is None and not recordings_shown:
        asked = _asked(recordings, key, pair)
        before = kept_study(folder, adjust=recordings.adjust, **asked)
    loaded = before[0] if before else read_study_inputs(folder, recordings, key, pair, group)
    with Meter("study", 1.0) as meter:
        shares = _PREPARED_SHARE, TESTS_SHARE

        def work(share: float) -> Callable[[float], None]:
            return lambda done: meter.advance(share * done)

        prepared = {} if before else prepare_study(loaded, work(shares[0]))
        study = before[1] if before else analyse(loaded, prepared, progress=work(1.0 - sum(shares)))
        result = conclude_study(study, seed=seed, resamples=resamples, progress=work(shares[1]))
    changes, not_kept = [], ""
    try:
        changes = keep(loaded, result) if group is None else []
    except UserError as error:
        not_kept = str(error)
    known = [session.path for session in study.sessions], loaded.recordings.digests
    facts = study_provenance(loaded.folder, *known, study.settings, command_line())
    shown = Shown.of_study(result, loaded, prepared)
    bad = any(notice.level == "error" for notice in result.notices)
    # The screen says what could not be tested.
    untested = [one for one in result.values if one.remark and not one.tested]
    bad |= any(one.other == study.other for one in untested if one.other)
    shown = replace(shown, changes=tuple(changes), provenance=facts)
    return shown, Analysed(study.analysis, result.notices, bad, not_kept)
