"""From epochs to fits, to the median inertia, and to the second fit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rigidimeter.analysis.estimation import (
    choose_method,
    estimate_delays,
    method_named,
    method_names,
    no_such_method,
)
from rigidimeter.analysis.estimation.alignment import MOST_EPOCHS, aligned_prepared
from rigidimeter.analysis.estimation.between_epochs import between_epochs
from rigidimeter.analysis.estimation.clock_error import with_clock_error
from rigidimeter.analysis.estimation.diagnostics import checked, checked_together
from rigidimeter.analysis.estimation.method_record import Progress
from rigidimeter.analysis.estimation.prepared import PreparedEpoch, prepare
from rigidimeter.analysis.estimation.scores import line_shares, score_prepared
from rigidimeter.analysis.estimation.screening import before_fit
from rigidimeter.analysis.estimation.stretches import longest_part
from rigidimeter.analysis.reading import Recording
from rigidimeter.core.errors import UserError
from rigidimeter.core.findings import Fact, Finding, found_between
from rigidimeter.core.records import Analysis, Axis, BandEstimate, Delay, Epoch, Fit, Task
from rigidimeter.core.settings import Settings, settings_from
from rigidimeter.core.words import short_names

DIFFERENT_INERTIA_PERCENT = 15.0
"""Recordings whose median J differ by more hardly are of one joint."""


class StepCosts(NamedTuple):
    """How long each step takes for one epoch, in ms or so: only proportions matter, to progress.

    The search for the delay takes longer where there is one.
    """

    delay: float
    score: float
    check: float
    fit: float


def step_costs(samples: float) -> StepCosts:
    """Return the costs of an epoch with so many samples of torque, as they were measured."""
    thousands = samples / 1000
    return StepCosts(
        delay=25 + 5 * thousands,
        score=4 + 0.75 * thousands,
        check=8 + 4.3 * thousands,
        fit=1.3 * thousands,
    )


SINGLE_FREQUENCY_SHARE = 0.85
"""Above this share of the angle's variance in one line, the epoch is an imposed sinusoid, unless
the velocity shows that it is steps to and fro (`LineShares`).

A sinusoid whose motion fills half the epoch reaches 0.95, a PRBS in the closed loop 0.5.
"""


def task_of(epoch: Epoch, settings: Settings) -> Task:
    """Return the epoch's task: as recorded, else a sinusoid if the motion holds a single line."""
    if epoch.task is not None:
        return epoch.task
    if before_fit(epoch, settings.estimation):
        return "prbs"  # it will fail with its reason among the fits
    return "sinusoid" if line_shares(epoch).single(SINGLE_FREQUENCY_SHARE) else "prbs"


class Preparation:
    """The epochs of one joint with what every analysis of them needs, each made once.

    Methods, checks and figures take from it what they share: tasks, the drive and the delay of each
    source, signals and spectral lines of each epoch. It keeps them as long as it is held.

    Parameters
    ----------
    epochs : iterable of Epoch
    settings : Settings
    """

    def __init__(self, epochs: Iterable[Epoch], settings: Settings) -> None:
        self.settings = settings
        self.epochs = tuple(epochs)
        tasks = [task_of(epoch, settings) for epoch in self.epochs]
        both = list(zip(self.epochs, tasks, strict=True))
        self._perturbed = prepare((e for e, task in both if task == "prbs"), settings)
        # A sinusoid is scored over whole cycles, and rests at its turning points.
        imposed = (longest_part(epoch) for epoch, task in both if task == "sinusoid")
        self._imposed = prepare(imposed, settings, screen=False)
        self._delays: tuple[Delay, ...] | None = None
        self._aligned: dict[int, PreparedEpoch] = {}

    def delays(self, progress: Progress = lambda _: None) -> tuple[Delay, ...]:
        """Return how late the torque is in each source."""
        if self._delays is None:
            by_source: dict[str, list[PreparedEpoch]] = {e.source: [] for e in self.epochs}
            for prepared in self._perturbed:
                by_source[prepared.epoch.source].append(prepared)
            self._delays = estimate_delays(by_source, lambda n: progress(self.costs.delay * n))
        return self._delays

    @cached_property
    def costs(self) -> StepCosts:
        """What a typical epoch costs in each step."""
        torques = [epoch.channels.get("torque_nm") for epoch in self.epochs]
        samples = [len(torque) for torque in torques if torque is not None]
        return step_costs(float(np.mean(samples)) if samples else 1000.0)

    def work(self, methods: Sequence[str]) -> float:
        """Return what analyses by these methods cost, the first with checks and scores."""
        n, costs = len(self._perturbed), self.costs
        searched = 0
        if any(name == "auto" or not method_named(name).as_recorded for name in methods):
            sources = Counter(prepared.epoch.source for prepared in self._perturbed)
            searched = sum(min(count, MOST_EPOCHS) for count in sources.values())
        fits = len(methods) * 2 * n * costs.fit
        return searched * costs.delay + fits + n * costs.check + len(self._imposed) * costs.score

    def perturbed(self, *, as_recorded: bool = False) -> list[PreparedEpoch]:
        """Return the perturbation epochs, on one clock or as they were recorded."""
        return self._perturbed if as_recorded else self._on_one_clock(self._perturbed)

    def imposed(self, *, as_recorded: bool = False) -> list[PreparedEpoch]:
        """Return the epochs of imposed sinusoids, on one clock or as they were recorded."""
        return self._imposed if as_recorded else self._on_one_clock(self._imposed)

    def analysed(self, *, as_recorded: bool = False) -> list[PreparedEpoch]:
        """Return the epochs of both kinds, perturbed ones first."""
        return [*self.perturbed(as_recorded=as_recorded), *self.imposed(as_recorded=as_recorded)]

    def _on_one_clock(self, epochs: Sequence[PreparedEpoch]) -> list[PreparedEpoch]:
        delays = self.delays()
        for prepared in epochs:
            if id(prepared) not in self._aligned:
                self._aligned[id(prepared)] = aligned_prepared(prepared, delays)
        return [self._aligned[id(prepared)] for prepared in epochs]


def analyse_prepared(
    preparation: Preparation,
    method: str = "auto",
    *,
    fits_alone: bool = False,
    progress: Progress = lambda _: None,
) -> Analysis:
    """Fit every perturbation epoch and score every sinusoidal one.

    First the channels of each source are brought onto one clock. Then two stages, as in
    Sec. 2.4.4: J, B and K for each epoch; then J held at the median of all included epochs of all
    conditions, and B and K again (Eq. 7). Every fitted epoch is checked; a check that excludes
    does so in both stages.

    Parameters
    ----------
    preparation : Preparation
    method : str
        The name of one of `analysis.estimation.METHODS`; ``auto`` chooses by what was recorded.
    fits_alone : bool
        Leave out the pooled fits, the scores of the sinusoids, and what does not decide whether an
        epoch counts.
    progress : callable
        Called with the work that was done, `Preparation.work` in all.
    """
    reason = ""
    if method == "auto":
        method, reason = choose_method(preparation.perturbed(as_recorded=True))
    estimator = method_named(method)
    as_recorded, costs = estimator.as_recorded, preparation.costs

    def fit_progress(epochs: float) -> None:
        progress(costs.fit * epochs)

    delays = () if as_recorded else preparation.delays(progress)
    fitted = preparation.perturbed(as_recorded=as_recorded)
    scores = []
    for prepared in () if fits_alone else preparation.imposed(as_recorded=as_recorded):
        scores.append(score_prepared(prepared))
        progress(costs.score)

    def fitted_by(
        epochs: Sequence[PreparedEpoch], inertia_kg_m2: float | None, pooled: bool
    ) -> tuple[list[Fit], list[Fit]]:
        made = estimator.fit(epochs, inertia_kg_m2, fit_progress, pooled)
        return with_clock_error(estimator.fit, epochs, inertia_kg_m2, made, delays)

    found, pooled = fitted_by(fitted, None, not fits_alone)
    fits = []
    for prepared, fit in zip(fitted, found, strict=True):
        fits.append(checked(prepared, fit, delays, exclusions_alone=fits_alone))
        progress(0.0 if fits_alone else costs.check)
    counted = [
        prepared.closed_as(fit.outcome)
        if not fit.outcome.included and prepared.epoch.closed.included and fit.n_samples > 0
        else prepared
        for prepared, fit in zip(fitted, fits, strict=True)
    ]
    if pooled and counted != fitted:  # what a check excludes must not be in the pool either
        made = estimator.fit(counted, None, lambda _: None, True)
        _, pooled = with_clock_error(estimator.fit, counted, None, made, delays)
    by_perturbation = estimator.uses_perturbation
    pooled = [_with_differences(fit, fits, by_perturbation, preparation.settings) for fit in pooled]
    sensitivity: Sequence[BandEstimate] = ()
    if not fits_alone:
        fits, pooled, sensitivity = checked_together(fitted, fits, pooled, estimator)
    included = [fit.inertia_kg_m2 for fit in fits if fit.outcome.included]
    inertia_kg_m2 = float(np.median(included)) if included else float("nan")
    if included:
        second, _ = fitted_by(fitted, inertia_kg_m2, False)
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
        tuple(sensitivity),
        () if fits_alone else tuple(_of_recordings(fits)),
        _axis(preparation),
    )


def _axis(preparation: Preparation) -> Axis:
    """Return how the joint's axis stands: as the settings state it; that of the virtual rig."""
    stated = preparation.settings.diagnostics.axis
    virtual = all(epoch.virtual for epoch in preparation.epochs)
    return "vertical" if stated == "unknown" and virtual else stated


def _with_differences(
    pooled: Fit, fits: Sequence[Fit], by_perturbation: bool, settings: Settings
) -> Fit:
    """Return a pooled fit with what its epochs say of a joint that differs between them."""
    own = [fit for fit in fits if fit.outcome.included and fit.condition == pooled.condition]
    found = between_epochs(own, by_perturbation, settings.diagnostics)
    return pooled if found is None else replace(pooled, findings=(*pooled.findings, found))


def _of_recordings(fits: Sequence[Fit]) -> Iterator[Finding]:
    """Yield that recordings differ in J: one median for all puts that into B and K."""
    by_source: dict[str, list[float]] = {}
    for fit in fits:
        if fit.outcome.included:
            by_source.setdefault(fit.source, []).append(fit.inertia_kg_m2)
    medians = {source: float(np.median(values)) for source, values in by_source.items()}
    if len(medians) < 2 or min(medians.values()) <= 0:
        return
    low, high = min(medians, key=medians.__getitem__), max(medians, key=medians.__getitem__)
    percent = 100.0 * (medians[high] / medians[low] - 1.0)
    if percent >= DIFFERENT_INERTIA_PERCENT:
        names = short_names(medians)
        facts: dict[str, Fact] = {"high": names[high], "high_j": medians[high]}
        facts |= {"low": names[low], "low_j": medians[low]}
        yield found_between("inertia_of_recordings", facts, percent, DIFFERENT_INERTIA_PERCENT)


def estimate(
    recording: Recording | Iterable[Epoch],
    method: str = "auto",
    *,
    settings: Settings | str | Path | Mapping[str, Any] | None = None,
    progress: Progress = lambda _: None,
) -> Analysis:
    """Estimate J, B and K of every epoch, and score the imposed sinusoids.

    Parameters
    ----------
    recording : Recording or iterable of Epoch
    method : str
        The name of an estimator; ``auto`` chooses by what was recorded.
    settings : Settings, path or mapping, optional
        Instead of those of the recording.
    progress : callable
        Called with the share of the work that was done since, 1 in all.

    Returns
    -------
    Analysis
        `table()` gives its epochs as a pandas table, `pooled` the estimates of all epochs together,
        `findings` what the checks found; in a notebook it shows itself as a table.

    Raises
    ------
    ValueError
        If there is no such method.
    UserError
        If `recording` is neither, such as a path; the settings are wrong.

    Examples
    --------
    >>> import rigidimeter as rm
    >>> estimates = rm.estimate(rm.data("elbow"))
    >>> estimates.method, len(estimates.fits)
    ('iv', 6)
    >>> estimates.table().groupby("condition")["stiffness_nm_rad"].median().round(2).to_dict()
    {'DBS': 1.44, 'OFF': 1.75}
    """
    if isinstance(recording, Recording):
        epochs: tuple[Any, ...] = recording.epochs
        settings = recording.settings if settings is None else settings
    else:
        epochs = tuple(recording) if isinstance(recording, Iterable) else (None,)
    if not all(isinstance(epoch, Epoch) for epoch in epochs):
        raise UserError(
            "estimate takes a Recording or a list of its epochs; read a path with rigidimeter.read"
        )
    if method not in method_names():
        raise ValueError(f"method {method!r}: {no_such_method(method)}")
    preparation = Preparation(epochs, settings_from(settings))
    work = preparation.work([method]) or 1.0
    return analyse_prepared(preparation, method, progress=lambda done: progress(done / work))
