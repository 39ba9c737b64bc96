"""A study folder from its tables to its rows: read, estimated, rated; then the recordings are gone.

Each subject is analysed apart, for J is held at the median of one joint; with one subject that is
the analysis of all. Methods of the sensitivity analysis run once each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.analysis.estimation import (
    Recorded,
    choose_method,
    estimate_recorded,
    method_names,
    no_such_method,
    prepare,
)
from rigidimeter.analysis.study.comparisons import sensitivity_methods
from rigidimeter.analysis.study.load import Recordings, load, without_excluded
from rigidimeter.analysis.study.measures import Primary, chosen_pair
from rigidimeter.analysis.study.ratings import corrected, study_ratings
from rigidimeter.analysis.study.rows import estimate_rows, together, typed
from rigidimeter.analysis.study.session_checks import deviations, exclusions_of
from rigidimeter.analysis.study.study import (
    GROUP,
    Naming,
    Study,
    naming,
    no_such_group,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_json
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Analysis, Epoch, Notice
from rigidimeter.core.settings import Settings, changed_settings
from rigidimeter.core.study_files import STUDY_FILE, StudyFolder, TableRow, read_study_folder

ANALYSIS, COMPARISON = "analysis", "comparison.json"
"""Where a study keeps what was concluded."""

Progress = Callable[[float], None]


@dataclass(frozen=True)
class Loaded:
    """A study folder with its recordings, ready to be estimated.

    Attributes
    ----------
    folder : StudyFolder
    names : Naming
    recordings : Recordings
    epochs : tuple of Epoch
        With what the operator excluded.
    operator : mapping of (str, str) to TableRow
        The operator's exclusions that met an epoch, by source and label.
    settings : Settings
        Those that the first session was recorded with, or what was given instead.
    method : str
        Of `study.toml`, or what was given instead.
    notices : tuple of Notice
    further : tuple of str
        Conditions with epochs that are compared with the reference beside those of `names.pair`.
    primary : Primary
    again : partial
        Reads it again, in the same way: by the folder, and what was asked as keywords.
    as_read : Settings
        Those that the folder was read with, whatever `settings` were made of them.
    """

    folder: StudyFolder
    names: Naming
    recordings: Recordings
    epochs: tuple[Epoch, ...]
    operator: Mapping[tuple[str, str], TableRow]
    settings: Settings
    method: str
    notices: tuple[Notice, ...]
    further: tuple[str, ...]
    primary: Primary
    again: partial[Loaded] = field(repr=False, compare=False)
    as_read: Settings = field(default_factory=Settings, repr=False)


def load_study(
    folder: Path,
    *,
    key: Path | None = None,
    settings: Settings | None = None,
    method: str = "auto",
    pair: tuple[str | None, str | None] = (None, None),
    group: str | None = None,
    progress: Progress = lambda _: None,
) -> Loaded:
    """Read a study folder and every recording in it.

    Parameters
    ----------
    folder : Path
    key : Path, optional
        A blinding key kept elsewhere.
    settings : Settings, optional
        Instead of those of the first session.
    method : str
        Instead of that of `study.toml`; ``auto`` leaves it.
    pair : (str or None, str or None)
        Other conditions than `study.toml` compares.
    group : str, optional
        Take the subjects of this group alone, of the column `group` of the sessions.
    progress : callable
        Called with the share of the recordings that was read since, 1 in all.

    Raises
    ------
    UserError
        If there is nothing to analyse, or an option names what does not exist.
    """
    options: dict[str, Any] = {"settings": settings, "method": method, "pair": pair, "group": group}
    # Wherever the working folder is then.
    again = partial(load_study, folder.absolute(), key=key and key.absolute(), **options)
    read = read_study_folder(folder, key)
    if group is not None:
        read = _of_group(read, group)
    about = read.about.analysis
    chosen = method if method != "auto" else about.method
    if chosen not in method_names():
        where = "--method" if method != "auto" else f"{folder / STUDY_FILE}: analysis.method ="
        raise UserError(f"{where} {chosen}: {no_such_method(chosen)}")
    names, notices = naming(read)
    if pair != (None, None):
        wanted = pair[0] or names.pair[0], pair[1] or names.pair[1]
        names = replace(names, pair=chosen_pair(names.known, wanted, holder="the study has"))
    recordings = load(read, names, progress=progress)
    epochs, operator, excluded = without_excluded(read, recordings)
    there = {epoch.condition for epoch in epochs} - {*names.pair}
    settings = settings or recordings.settings or Settings()
    if about.axis != "unknown":
        where = f"{folder / STUDY_FILE}: analysis.axis"
        settings = changed_settings(settings, {"diagnostics": {"axis": about.axis}}, where)
    primary = primary_of(read, (entry.day for entry in recordings.entries.values()))
    return Loaded(
        read,
        names,
        recordings,
        epochs,
        operator,
        settings,
        chosen,
        (*read.notices, *notices, *recordings.notices, *excluded, *primary.notices),
        tuple(name for name in names.known if name in there) if pair[1] is None else (),
        primary,
        again,
        settings,
    )


def _of_group(read: StudyFolder, group: str) -> StudyFolder:
    """Return a study of one group of subjects: their sessions, ratings and exclusions."""
    sessions = tuple(row for row in read.sessions if row[GROUP] == group)
    if not sessions:
        source = str(read.folder / read.about.sessions)
        raise UserError(no_such_group(source, group, (row[GROUP] for row in read.sessions)))
    paths, subjects = ({row[name] for row in sessions} for name in ("path", "subject"))
    return replace(
        read,
        about=read.about.model_copy(update={"title": f"{read.about.title}, group {group}"}),
        sessions=sessions,
        ratings=tuple(row for row in read.ratings if row["subject"] in subjects),
        exclusions=tuple(row for row in read.exclusions if row["path"] in paths),
    )


def primary_of(read: StudyFolder, days: Iterable[str]) -> Primary:
    """Return what a study concludes from; `days` are those of its recordings as it names them."""
    first = min((day for day in map(_date, days) if day is not None), default=None)
    if "primary" in read.about.model_fields_set:
        return Primary(read.about.primary, "study.toml", first)
    earlier = read.folder / ANALYSIS / COMPARISON
    try:
        found = read_json(earlier) if earlier.is_file() else None
    except UserError:
        found = None  # damaged: what stores the analysis says so
    known = found.get("primary") if isinstance(found, dict) else None
    if found is None or (isinstance(known, dict) and known.get("source") == "default"):
        return Primary(first_recording=first)
    return Primary(source="earlier comparison", first_recording=first)


def _date(day: str) -> date | None:
    try:
        return date.fromisoformat(day)
    except ValueError:
        return None


def prepare_study(loaded: Loaded, progress: Progress = lambda _: None) -> dict[str, Recorded]:
    """Return the epochs of a study as they are estimated, by subject.

    Parameters
    ----------
    loaded : Loaded
    progress : callable
        Called with the share of the work that was done since, 1 in all.
    """
    own: dict[str, list[Epoch]] = {}
    for epoch in loaded.epochs:
        own.setdefault(loaded.recordings.entries[epoch.source].subject, []).append(epoch)
    part = partial(_part, progress, len(own))
    return {subject: prepare(each, loaded.settings, progress=part) for subject, each in own.items()}


def estimate_study(
    loaded: Loaded, progress: Progress = lambda _: None
) -> tuple[Analysis, list[Notice]]:
    """Estimate and score every epoch of a study, by one method, without comparing anything.

    Parameters
    ----------
    loaded : Loaded
    progress : callable
        Called with the share of the work that was done since, 1 in all.
    """
    half = partial(_part, progress, 2)
    return _estimated(prepare_study(loaded, half), loaded.method, half)


def analyse(
    loaded: Loaded,
    prepared: Mapping[str, Recorded] | None = None,
    *,
    progress: Progress = lambda _: None,
) -> Study:
    """Estimate every epoch of a study, by each method, and return it as rows.

    Parameters
    ----------
    loaded : Loaded
    prepared : mapping of str to Recorded, optional
        As `prepare_study`, where that is needed for more than this.
    progress : callable
        Called with the share of the work that was done since, 1 in all.
    """
    epochs, sessions = loaded.epochs, loaded.recordings.entries
    pair = loaded.names.pair
    fitted = any(epoch.task == "prbs" for epoch in epochs)
    others = sensitivity_methods() if fitted and all(pair) else ()
    again = len(others) - (loaded.method in ("auto", *others)) if others else 0
    share = partial(_part, progress, 1 + again + (prepared is None))
    subjects = prepare_study(loaded, share) if prepared is None else prepared
    main, notices = _estimated(subjects, loaded.method, share)
    analyses = {main.method: main}
    for method in others:
        if method != main.method:
            analyses[method], _ = _estimated(subjects, method, share, fits_alone=True)
    parts = [estimate_rows(analyses, sessions, epochs, loaded.names.conditions)]
    notices += _lacking(main, epochs, pair)
    groups = {entry.subject: entry.group for entry in sessions.values()}
    ratings, of_ratings = study_ratings(loaded.folder, loaded.names, groups)
    if ratings is not None:
        parts += [typed(ratings.rows), corrected(ratings)]
    return Study(
        together(parts),
        *pair,
        loaded.further,
        title=loaded.folder.about.title,
        primary=loaded.primary,
        settings=loaded.settings,
        conditions=loaded.names.conditions,
        sessions=tuple(session.entry for session in loaded.recordings.sessions),
        left_out=loaded.recordings.left_out,
        exclusions=tuple(exclusions_of(epochs, main, sessions, loaded.operator)),
        deviations=deviations(
            loaded.folder.folder, [session.entry for session in loaded.recordings.sessions]
        ),
        analysis=main,
        notices=(*loaded.notices, *notices, *of_ratings),
        ratings=ratings,
        blinded=loaded.names.blinded,
        virtual=all(epoch.virtual for epoch in epochs),
        partly_virtual=any(epoch.virtual for epoch in epochs),
        digests={**loaded.folder.digests, **loaded.recordings.digests},
        folder_read=loaded.again,
    )


def _part(progress: Progress, parts: int, share: float) -> None:
    progress(share / parts)


def _estimated(
    subjects: Mapping[str, Recorded],
    method: str,
    progress: Progress,
    *,
    fits_alone: bool = False,
) -> tuple[Analysis, list[Notice]]:
    """Analyse each subject apart and put the parts together, in the order of the epochs."""
    part = partial(_part, progress, len(subjects))
    if len(subjects) < 2:
        (recorded,) = subjects.values()
        return estimate_recorded(recorded, method, fits_alone=fits_alone, progress=part), []
    reason = ""
    if method == "auto":
        method, reason = choose_method([r for own in subjects.values() for r in own.perturbed])
    parts = {
        subject: estimate_recorded(own, method, fits_alone=fits_alone, progress=part)
        for subject, own in subjects.items()
    }
    reasons = dict.fromkeys([reason, *(one.method_reason for one in parts.values())])
    fits = [fit for one in parts.values() for fit in one.fits]
    included = [fit.inertia_kg_m2 for fit in fits if fit.outcome.included]
    every = {one.axis for one in parts.values()}
    merged = Analysis(
        method=method,
        fits=tuple(fits),
        fixed_inertia=tuple(fit for one in parts.values() for fit in one.fixed_inertia),
        inertia_kg_m2=float(np.median(included)) if included else float("nan"),
        scores=tuple(score for one in parts.values() for score in one.scores),
        delays=tuple(delay for one in parts.values() for delay in one.delays),
        method_reason=". ".join(filter(None, reasons)),
        across=tuple(_of_subjects(parts)),
        axis=every.pop() if len(every) == 1 else "unknown",
    )
    if not included:
        return merged, []
    held = ", ".join(f"{subject} {one.inertia_kg_m2:.4g}" for subject, one in parts.items())
    text = f"J is held at the median of each subject, in kg·m²: {held}"
    return merged, [Notice("warning", text)]


def _of_subjects(parts: Mapping[str, Analysis]) -> Iterator[Finding]:
    """Yield the cautions of each subject that no epoch carries, each with its condition."""
    for subject, part in parts.items():
        carried = {
            (fit.condition, one.name, one.level) for fit in part.fits for one in fit.findings
        }
        carried |= {("", name, level) for _, name, level in carried}
        pooled = [(fit.condition, one) for fit in part.pooled for one in fit.findings]
        for where, one in (*pooled, *((one.condition, one) for one in part.across)):
            if one.level != "note" and (where, one.name, one.level) not in carried:
                yield replace(one, condition=where, facts={**one.facts, "subject": subject})


def _lacking(analysis: Analysis, epochs: Sequence[Epoch], pair: tuple[str, str]) -> list[Notice]:
    """Return what keeps all measures of recordings from being compared."""
    if not analysis.results:
        return [Notice("error", "no epoch could be fitted or scored, so nothing is compared")]
    recorded = {one.condition for one in analysis.results}
    absent = [name or "a second condition" for name in pair if name not in recorded]
    if not absent:
        return []
    present = next((name for name in pair if name in recorded), "other conditions")
    text = (
        f"there is no session in {' or '.join(absent)}, only in {present}, so nothing is compared"
    )
    return [Notice("error", text)]
