"""From epochs to fits, to the median inertia, to the second fit, to comparisons.

Acquisition and study meet only in recorded files, so a laboratory can analyse with no driver
installed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from rigidimeter.estimation import (
    aligned,
    choose_method,
    epoch_signals,
    estimate_delays,
    fit_epochs,
    score_epoch,
    single_frequency_share,
)
from rigidimeter.estimation.closedloop import CLOSED_LOOP, drives
from rigidimeter.estimation.diagnostics import diagnose
from rigidimeter.estimation.screening import before_fit
from rigidimeter.records import Analysis, Delay, Epoch, Fit, Notice, Outcome, Score, Task
from rigidimeter.settings import Settings
from rigidimeter.statistics import RankSum, Summary, ranksum, summarise
from rigidimeter.units import rad_from_deg

__all__ = [
    "MEASURES",
    "Comparison",
    "Measure",
    "Study",
    "analyse",
    "compare",
    "conditions",
    "doubts",
    "task_of",
]

SINGLE_FREQUENCY_SHARE = 0.85
"""Above this share of the angle's variance in one line, the epoch is an imposed sinusoid.

A sinusoid whose motion fills half the epoch reaches 0.95, a PRBS in the closed loop 0.5.
"""

DIFFERENT_INERTIA = 0.15
"""Sources whose median J differ by more than this hardly are one joint."""

FEWEST_FOR_TEST = 3
"""Below this many values in a condition there is no rank-sum test."""


class Measure(NamedTuple):
    """What is compared: stored name, name for people, unit, and where an analysis holds it."""

    name: str
    title: str
    unit: str
    results: Callable[[Analysis], Sequence[Fit | Score]]


MEASURES = (
    Measure("inertia_kg_m2", "Inertia J", "kg·m²", lambda found: found.fits),
    Measure("damping_nm_s_rad", "Viscous damping B", "N·m·s/rad", lambda f: f.fixed_inertia),
    Measure("stiffness_nm_rad", "Stiffness K", "N·m/rad", lambda f: f.fixed_inertia),
    Measure("impulse_nm_s", "Angular impulse", "N·m·s", lambda found: found.scores),
    Measure("work_j", "Work", "J", lambda found: found.scores),
)
"""Inertia is from the first stage; damping and stiffness are from the second, at fixed inertia."""


@dataclass(frozen=True)
class Comparison:
    """One measure in two conditions.

    Attributes
    ----------
    measure : str
        Stored name with unit, for example ``damping_nm_s_rad``.
    title : str
        Name for people, for example ``Viscous damping B``.
    unit : str
        For axes and tables, for example ``N·m·s/rad``.
    reference, other : str
        The two conditions; differences are reference − other.
    values : mapping of str to tuple of float
        The included values by condition, in the order of recording.
    summaries : mapping of str to Summary
        By condition.
    excluded : mapping of str to int
        How many epochs of each condition have no included value.
    test : RankSum or None
        None when a condition has too few values, for the reason in `remark`.
    remark : str
        Why there is no test, else empty.
    """

    measure: str
    title: str
    unit: str
    reference: str
    other: str
    values: Mapping[str, tuple[float, ...]]
    summaries: Mapping[str, Summary]
    excluded: Mapping[str, int]
    test: RankSum | None
    remark: str = ""

    @property
    def paired(self) -> bool:
        """Whether there are two conditions; with one, `other` means nothing."""
        return len(self.summaries) == 2


@dataclass(frozen=True)
class Study:
    """Everything that a report shows."""

    title: str
    settings: Settings
    epochs: tuple[Epoch, ...]
    analysis: Analysis
    comparisons: tuple[Comparison, ...]
    notices: tuple[Notice, ...]
    provenance: Mapping[str, str]


def task_of(epoch: Epoch, settings: Settings) -> Task:
    """Return the epoch's task: as recorded, else a sinusoid if the angle holds a single line."""
    if epoch.task is not None:
        return epoch.task
    if before_fit(epoch, settings.estimation):
        return "prbs"  # it will fail with its reason among the fits
    return "sinusoid" if single_frequency_share(epoch) > SINGLE_FREQUENCY_SHARE else "prbs"


def analyse(
    epochs: Iterable[Epoch],
    settings: Settings,
    method: str = "auto",
    *,
    progress: Callable[[str], None] = lambda _: None,
) -> Analysis:
    """Fit every perturbation epoch and score every sinusoidal one.

    First the channels of each source are brought onto one clock. Then two stages, as in
    Sec. 2.4.4: J, B and K for each epoch; then J held at the median of all included epochs of all
    conditions, and B and K again (Eq. 7). Every fitted epoch is checked; a check that excludes
    does so in both stages.

    Parameters
    ----------
    epochs : iterable of Epoch
    settings : Settings
    method : str
        A name of `estimation.METHODS`; ``auto`` chooses by what was recorded.
    progress : callable
        Called with the name of each epoch once it is done, in either stage.
    """
    everything = list(epochs)
    tasks = [task_of(epoch, settings) for epoch in everything]
    fitted = [epoch for epoch, task in zip(everything, tasks, strict=True) if task == "prbs"]
    reason = ""
    if method == "auto":
        method, reason = choose_method(fitted)
    delays: tuple[Delay, ...] = ()
    if method != "published":  # which is kept as it was printed
        by_source: dict[str, list[Epoch]] = {epoch.source: [] for epoch in everything}
        for epoch in fitted:
            by_source[epoch.source].append(epoch)
        delays = estimate_delays(by_source, settings)
        everything = [aligned(epoch, delays) for epoch in everything]
        fitted = [aligned(epoch, delays) for epoch in fitted]
    scores = []
    for epoch, task in zip(everything, tasks, strict=True):
        if task == "sinusoid":
            scores.append(score_epoch(epoch, settings.scores, settings.estimation))
            progress(epoch.name)
    if method in CLOSED_LOOP:
        reason += _without_drive(fitted, settings, bool(reason))
    fits, pooled = fit_epochs(fitted, method, settings, progress=progress)
    fits = [checked(epoch, fit, settings) for epoch, fit in zip(fitted, fits, strict=True)]
    refused = [
        not fit.outcome.included and epoch.closed.included and fit.n_samples > 0
        for epoch, fit in zip(fitted, fits, strict=True)
    ]
    if any(refused):  # what a check excludes must not be in the pool either
        kept = [
            replace(epoch, closed=fit.outcome) if out else epoch
            for epoch, fit, out in zip(fitted, fits, refused, strict=True)
        ]
        _, pooled = fit_epochs(kept, method, settings)
    included = [fit.inertia_kg_m2 for fit in fits if fit.outcome.included]
    inertia_kg_m2 = float(np.median(included)) if included else float("nan")
    if included:
        second, _ = fit_epochs(fitted, method, settings, inertia_kg_m2, progress)
        # What did not count in the first stage does not in the second.
        fixed = [
            two if one.outcome.included else replace(two, outcome=one.outcome)
            for one, two in zip(fits, second, strict=True)
        ]
    else:  # no epoch gives a median to hold
        fixed = [Fit(fit.source, fit.epoch, fit.condition, fit.method, fit.outcome) for fit in fits]
    return Analysis(
        method,
        tuple(fits),
        tuple(fixed),
        inertia_kg_m2,
        tuple(scores),
        tuple(pooled),
        delays,
        reason,
    )


def _without_drive(epochs: Sequence[Epoch], settings: Settings, after: bool) -> str:
    """Say of which sources the drive is unknown, and what that costs."""
    unknown = [source for source, drive in drives(epochs, settings).items() if drive is None]
    if not unknown:
        return ""
    return (
        f"{'. ' if after else ''}In {', '.join(unknown)} command and velocity do not show the "
        "drive, so the motion between samples is interpolated: J may come out about 1 % low and, "
        "where the subject pushes, B some percent high"
    )


def checked(epoch: Epoch, fit: Fit, settings: Settings) -> Fit:
    """Return the fit with what the checks found, excluded if one of them says so."""
    if fit.n_samples == 0:
        return fit
    try:
        signals = epoch_signals(epoch, "bandlimited", settings.estimation)
    except ValueError:
        return fit  # the fit has said why
    from_session = epoch.excitation_hz is not None
    limit_rad = rad_from_deg(settings.guard.position_limit_deg) if from_session else None
    findings = diagnose(
        epoch,
        signals,
        (fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad),
        settings.diagnostics,
        position_limit_rad=limit_rad,
    )
    failed = [finding for finding in findings if finding.remedy]
    grave = [finding for finding in failed if finding.level == "exclude"]
    outcome = fit.outcome
    if grave and outcome.included:
        outcome = Outcome("excluded", f"{grave[0].text}; {grave[0].remedy}")
    return replace(fit, outcome=outcome, findings=tuple(failed))


def doubts(analysis: Analysis) -> tuple[Notice, ...]:
    """Return what looks wrong with an analysis as a whole, and what to do about it."""
    return (*_misfit_doubts(analysis), *_source_doubts(analysis), *_sign_doubts(analysis))


def _misfit_doubts(analysis: Analysis) -> tuple[Notice, ...]:
    return tuple(
        Notice("warning", f"{fit.condition or 'all epochs'}: {finding.text}; {finding.remedy}")
        for fit in analysis.pooled
        for finding in fit.findings
    )


def _source_doubts(analysis: Analysis) -> tuple[Notice, ...]:
    """Say so when sources differ in J: one median for all would put the difference into K."""
    by_source: dict[str, list[float]] = {}
    for fit in analysis.fits:
        if fit.outcome.included:
            by_source.setdefault(fit.source, []).append(fit.inertia_kg_m2)
    medians = {source: float(np.median(values)) for source, values in by_source.items()}
    if len(medians) < 2 or min(medians.values()) <= 0:
        return ()
    low, high = min(medians, key=lambda s: medians[s]), max(medians, key=lambda s: medians[s])
    if medians[high] / medians[low] - 1 < DIFFERENT_INERTIA:
        return ()
    text = (
        f"the median J of {high} ({medians[high]:.4g} kg·m²) is "
        f"{100 * (medians[high] / medians[low] - 1):.0f} % above that of {low} "
        f"({medians[low]:.4g} kg·m²); B and K at one median J are then wrong for both. Analyse "
        "different joints or subjects apart"
    )
    return (Notice("warning", text),)


def _sign_doubts(analysis: Analysis) -> tuple[Notice, ...]:
    included = [fit for fit in analysis.fits if fit.outcome.included]
    of_all = f"of {len(included)} included epochs"
    turned = [
        fit
        for fit in included
        if max(fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad) < 0
    ]
    if turned:
        text = (
            f"J, B and K are all negative in {len(turned)} {of_all}: the torque has the wrong "
            "sign; a sensor that reports the joint's reaction needs --reaction"
        )
        return (Notice("warning", text),)
    massless = [fit for fit in included if fit.inertia_kg_m2 <= 0]
    if massless:
        text = (
            f"J is not greater than zero in {len(massless)} {of_all}, which no joint can be: the "
            "channels are too slow, too noisy or late against each other for an inertia this small"
        )
        return (Notice("warning", text),)
    negative = [fit for fit in included if min(fit.damping_nm_s_rad, fit.stiffness_nm_rad) < 0]
    if negative:
        text = (
            f"B or K is negative in {len(negative)} {of_all}: the subject may have pushed, or the "
            "channels are late against each other; look at R² before using them"
        )
        return (Notice("warning", text),)
    return ()


def conditions(analysis: Analysis) -> tuple[str, ...]:
    """Return the named conditions in order of appearance, ``OFF`` first where it occurs."""
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    seen = dict.fromkeys(result.condition for result in results if result.condition)
    return tuple(sorted(seen, key=lambda condition: condition != "OFF"))


def compare(
    analysis: Analysis, reference: str | None = None, other: str | None = None
) -> tuple[Comparison, ...]:
    """Compare two conditions in J, B, K, impulse and work; B and K with the inertia held.

    Without names, the first two conditions that `conditions` gives. An analysis with one condition
    gives its summaries and no test.
    """
    names = conditions(analysis) or ("",)
    first = reference if reference is not None else names[0]
    rest = [name for name in names if name != first]
    second = other if other is not None else (rest[0] if rest else "")
    return tuple(
        _comparison(measure, results, first, second)
        for measure in MEASURES
        if (results := measure.results(analysis))
    )


def _comparison(
    measure: Measure,
    results: Sequence[Fit | Score],
    reference: str,
    other: str,
) -> Comparison:
    groups = [reference, other] if other else [reference]
    values = {
        name: tuple(
            float(getattr(result, measure.name))
            for result in results
            if result.condition == name and result.outcome.included
        )
        for name in groups
    }
    excluded = {
        name: sum(r.condition == name and not r.outcome.included for r in results)
        for name in groups
    }
    test, remark = None, ""
    if not other:
        remark = "only one condition was recorded"
    elif min(len(values[name]) for name in groups) < FEWEST_FOR_TEST:
        counts = " and ".join(f"{len(values[name])} in {name}" for name in groups)
        remark = f"a test needs {FEWEST_FOR_TEST} epochs in each condition; there are {counts}"
    else:
        test = ranksum(values[reference], values[other])
    summaries = {name: summarise(values[name]) for name in groups}
    return Comparison(
        measure.name,
        measure.title,
        measure.unit,
        reference,
        other,
        values,
        summaries,
        excluded,
        test,
        remark,
    )
