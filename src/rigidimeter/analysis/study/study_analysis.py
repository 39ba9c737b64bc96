"""A study folder from its tables to its conclusions.

Each subject is analysed apart, for J is held at the median of one joint; with one subject that is
the analysis of all. Methods of the sensitivity analysis run once each.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from rigidimeter.analysis.estimation import (
    Progress,
    Recorded,
    choose_method,
    estimate_recorded,
    method_named,
    method_names,
    no_such_method,
    prepare,
)
from rigidimeter.analysis.study.blinding import Naming, naming
from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.comparison import (
    against_reference,
    compare_measures,
    day_tests,
    gathered,
    with_further,
)
from rigidimeter.analysis.study.deviations import deviations
from rigidimeter.analysis.study.exclusions import exclusions_of, operators_exclusions
from rigidimeter.analysis.study.families import Primary, primary_of
from rigidimeter.analysis.study.measures import RATING, chosen_pair
from rigidimeter.analysis.study.ratings_model import rated, ratings_comparison, ratings_days
from rigidimeter.analysis.study.results import SensitivityRow, SessionEntry, StudyResult
from rigidimeter.analysis.study.sensitivity import sensitivity_methods, sensitivity_rows
from rigidimeter.analysis.study.sessions import Gathered, gather
from rigidimeter.core.errors import UserError
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Analysis, Epoch, Notice
from rigidimeter.core.settings import Settings, changed_settings
from rigidimeter.core.study_files import STUDY_FILE, StudyFolder, TableRow, read_study_folder

GROUP = "group"
"""The column that says of which group, such as patients, a subject is."""

TESTS_SHARE = 0.1
"""Of the work: what the tests of all measures take."""


@dataclass(frozen=True)
class StudyRead:
    """A study folder with its recordings, ready to be analysed.

    Attributes
    ----------
    folder : StudyFolder
    names : Naming
    gathered : Gathered
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
        What the study concludes from.
    """

    folder: StudyFolder
    names: Naming
    gathered: Gathered
    epochs: tuple[Epoch, ...]
    operator: Mapping[tuple[str, str], TableRow]
    settings: Settings
    method: str
    notices: tuple[Notice, ...]
    further: tuple[str, ...] = ()
    primary: Primary = Primary()  # noqa: RUF009


def read_study(
    folder: Path,
    *,
    key: Path | None = None,
    settings: Settings | None = None,
    method: str = "auto",
    pair: tuple[str | None, str | None] = (None, None),
    group: str | None = None,
    progress: Progress = lambda _: None,
) -> StudyRead:
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
    read = read_study_folder(folder, key)
    if group is not None:
        read = _of_group(read, group)
    chosen = method if method != "auto" else read.about.analysis.method
    if chosen not in method_names():
        where = "--method" if method != "auto" else f"{folder / 'study.toml'}: analysis.method ="
        raise UserError(f"{where} {chosen}: {no_such_method(chosen)}")
    stated = read.about.analysis.axis
    names, said = naming(read)
    if pair != (None, None):
        wanted = pair[0] or names.pair[0], pair[1] or names.pair[1]
        holder = "the study has"
        names = replace(names, pair=chosen_pair(names.known, wanted, holder=holder))
    gathered = gather(read, names, progress=progress)
    epochs, operator, excluded = operators_exclusions(read, gathered)
    there = {epoch.condition for epoch in epochs} - {*names.pair}
    settings = settings or gathered.settings or Settings()
    if stated != "unknown":
        about = f"{folder / STUDY_FILE}: analysis.axis"
        settings = changed_settings(settings, {"diagnostics": {"axis": stated}}, about)
    days = (entry.day for entry in gathered.entries.values())
    primary = primary_of(read, days)
    return StudyRead(
        read,
        names,
        gathered,
        epochs,
        operator,
        settings,
        chosen,
        (*read.notices, *said, *gathered.notices, *excluded, *primary.notices),
        tuple(name for name in names.known if name in there) if pair[1] is None else (),
        primary,
    )


def no_such_group(source: str, group: str, labels: Iterable[str]) -> str:
    """Return that a table has no such group of subjects, and which it has."""
    known = ", ".join(filter(None, dict.fromkeys(labels)))
    return f"{source}: there is no group {group}; there are: {known or 'none'}"


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


def analyse_study(
    read: StudyRead,
    *,
    seed: int = 1,
    resamples: int = 9999,
    progress: Progress = lambda _: None,
) -> StudyResult:
    """Analyse a study: estimates, comparisons, days, effects, ratings, sensitivity, exclusions.

    Parameters
    ----------
    read : StudyRead
    seed, resamples : int
        Of the bootstrap.
    progress : callable
        Called with the share of the work that was done since, 1 in all.
    """
    sessions = read.gathered.entries
    pair = read.names.pair
    fitted = [epoch for epoch in read.epochs if epoch.task == "prbs"]
    others = sensitivity_methods() if fitted and all(pair) else ()
    # Preparing, the main method, and the others but for one that is the main one.
    again = len(others) - (read.method in ("auto", *others)) if others else 0
    each = (1.0 - TESTS_SHARE) / (2 + again)

    def done(share: float) -> None:
        progress(each * share)

    subjects = _by_subject(read.epochs, sessions, read.settings, done)
    main, notices = _analysed(subjects, read.method, done)
    comparisons = gathered(main, pair, sessions)
    ratings, said = rated(read.folder, read.names)
    if ratings is not None:
        comparisons = (*comparisons, _grouped(ratings_comparison(ratings), sessions.values()))
    comparisons, differences = compare_measures(
        comparisons,
        seed=seed,
        resamples=resamples,
        progress=lambda share: progress(TESTS_SHARE * share),
    )
    comparisons, further = with_further(comparisons, _further(read, comparisons))
    notices += [*_lacking([c for c in comparisons if c.measure is not RATING], pair), *said]
    ready = {} if ratings is None else {RATING.name: ratings_days(ratings)}
    every = day_tests((*comparisons, *further), ready, read.primary)
    comparisons, further = every[: len(comparisons)], every[len(comparisons) :]
    rows: list[SensitivityRow] = []
    if others:
        analyses = {main.method: main}
        for method in others:
            if method != main.method:
                analyses[method], _ = _analysed(subjects, method, done, fits_alone=True)
        ordered = {name: analyses[name] for name in others} | analyses
        rows, said = sensitivity_rows(ordered, main.method, sessions, pair)
        notices += said
    return StudyResult(
        title=read.folder.about.title,
        reference=pair[0],
        other=pair[1],
        comparisons=comparisons,
        differences=differences,
        notices=(*read.notices, *notices),
        seed=seed,
        resamples=resamples,
        analysis=main,
        epochs=read.epochs,
        prepared=tuple(
            ready
            for own in subjects.values()
            for ready in own.analysed(as_recorded=method_named(main.method).as_recorded)
        ),
        settings=read.settings,
        conditions=read.names.conditions,
        sessions=tuple(session.entry for session in read.gathered.sessions),
        blinded=read.names.blinded,
        virtual=all(epoch.virtual for epoch in read.epochs),
        ratings=ratings,
        sensitivity=tuple(rows),
        exclusions=tuple(exclusions_of(read.epochs, main, sessions, read.operator)),
        left_out=read.gathered.left_out,
        own_rig=read.gathered.settings is not None,
        further=further,
        primary=read.primary,
        deviations=deviations(
            read.folder.folder, [session.entry for session in read.gathered.sessions]
        ),
    )


def _grouped(c: Comparison, sessions: Iterable[SessionEntry]) -> Comparison:
    """Return the comparison of the ratings, which name a subject, with their groups."""
    groups = {session.subject: session.group for session in sessions}
    own = tuple(replace(o, group=groups.get(o.subject, "")) for o in c.observations)
    return replace(c, observations=own)


def _lacking(comparisons: Sequence[Comparison], pair: tuple[str, str]) -> list[Notice]:
    """Say what keeps all measures of recordings from being compared."""
    if not comparisons:
        return [Notice("error", "no epoch could be fitted or scored, so nothing is compared")]
    recorded = {
        name: sum(c.summaries[name].n + c.excluded[name] for c in comparisons if name in c.pair)
        for name in pair
    }
    absent = [name or "a second condition" for name, count in recorded.items() if not count]
    if not absent:
        return []
    present = next((name for name, count in recorded.items() if count), "other conditions")
    text = (
        f"there is no session in {' or '.join(absent)}, only in {present}, so nothing is compared"
    )
    return [Notice("error", text)]


def _further(read: StudyRead, comparisons: Sequence[Comparison]) -> list[Comparison]:
    """Return the comparisons of further conditions; of the ratings with their test by days."""
    found = []
    for c in against_reference(comparisons, read.further):
        if c.measure is not RATING:
            found.append(c)
            continue
        ratings, _ = rated(read.folder, replace(read.names, pair=(c.reference, c.other)))
        if ratings is not None:
            found.append(replace(ratings_comparison(ratings), days=ratings_days(ratings)))
    return found


def estimate_study(
    read: StudyRead, progress: Progress = lambda _: None
) -> tuple[Analysis, list[Notice]]:
    """Estimate and score every epoch of a study, without comparing anything.

    Parameters
    ----------
    read : StudyRead
    progress : callable
        Called with the share of the work that was done since, 1 in all.
    """
    sessions = read.gathered.entries
    subjects = _by_subject(read.epochs, sessions, read.settings, lambda n: progress(0.5 * n))
    return _analysed(subjects, read.method, lambda n: progress(0.5 * n))


def _by_subject(
    epochs: Sequence[Epoch],
    sessions: Mapping[str, SessionEntry],
    settings: Settings,
    progress: Progress,
) -> dict[str, Recorded]:
    own: dict[str, list[Epoch]] = {}
    for epoch in epochs:
        own.setdefault(sessions[epoch.source].subject, []).append(epoch)
    part = partial(_part, progress, len(own))
    return {subject: prepare(each, settings, progress=part) for subject, each in own.items()}


def _part(progress: Progress, parts: int, share: float) -> None:
    progress(share / parts)


def _beyond_epochs(part: Analysis) -> Iterator[tuple[str, Finding]]:
    """Yield the cautions of a subject that no epoch carries, each with its condition."""
    carried = {(fit.condition, one.name, one.level) for fit in part.fits for one in fit.findings}
    carried |= {("", name, level) for _, name, level in carried}
    pooled = [(fit.condition, one) for fit in part.pooled for one in fit.findings]
    for where, one in (*pooled, *((one.condition, one) for one in part.across)):
        if one.level != "note" and (where, one.name, one.level) not in carried:
            yield where, one


def _analysed(
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
    across = [
        replace(finding, condition=where, facts={**finding.facts, "subject": subject})
        for subject, part in parts.items()
        for where, finding in _beyond_epochs(part)
    ]
    reasons = dict.fromkeys([reason, *(part.method_reason for part in parts.values())])
    fits = [fit for part in parts.values() for fit in part.fits]
    included = [fit.inertia_kg_m2 for fit in fits if fit.outcome.included]
    merged = Analysis(
        method=method,
        fits=tuple(fits),
        fixed_inertia=tuple(fit for part in parts.values() for fit in part.fixed_inertia),
        inertia_kg_m2=float(np.median(included)) if included else float("nan"),
        scores=tuple(score for part in parts.values() for score in part.scores),
        delays=tuple(delay for part in parts.values() for delay in part.delays),
        method_reason=". ".join(filter(None, reasons)),
        across=tuple(across),
        axis=axes.pop() if len(axes := {part.axis for part in parts.values()}) == 1 else "unknown",
    )
    notices = []
    if included:
        held = ", ".join(f"{subject} {part.inertia_kg_m2:.4g}" for subject, part in parts.items())
        text = f"J is held at the median of each subject, in kg·m²: {held}"
        notices.append(Notice("warning", text))
    return merged, notices
