"""From epochs to fits, to the median inertia, and to the second fit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from rigidimeter.estimation import (
    aligned,
    choose_method,
    estimate_delays,
    fit_epochs,
    method_named,
    score_epoch,
    single_frequency_share,
)
from rigidimeter.estimation.closedloop import drives
from rigidimeter.estimation.diagnostics import checked
from rigidimeter.estimation.screening import before_fit
from rigidimeter.recording import Recording
from rigidimeter.records import Analysis, Delay, Epoch, Fit, Task
from rigidimeter.settings import Settings

__all__ = ["analyse", "estimate", "task_of"]

SINGLE_FREQUENCY_SHARE = 0.85
"""Above this share of the angle's variance in one line, the epoch is an imposed sinusoid.

A sinusoid whose motion fills half the epoch reaches 0.95, a PRBS in the closed loop 0.5.
"""


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
    delays: Sequence[Delay] | None = None,
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
        The name of one of `estimation.METHODS`; ``auto`` chooses by what was recorded.
    delays : sequence of Delay, optional
        Of every source, as another analysis of the same epochs found them: they do not depend on
        the method, and cost the most.
    progress : callable
        Called with the name of each epoch once it is done, in either stage.
    """
    everything = list(epochs)
    tasks = [task_of(epoch, settings) for epoch in everything]
    fitted = [epoch for epoch, task in zip(everything, tasks, strict=True) if task == "prbs"]
    reason = ""
    if method == "auto":
        method, reason = choose_method(fitted)
    used: Sequence[Delay] = ()
    estimator = method_named(method)
    if not estimator.as_recorded:
        by_source: dict[str, list[Epoch]] = {epoch.source: [] for epoch in everything}
        for epoch in fitted:
            by_source[epoch.source].append(epoch)
        used = estimate_delays(by_source, settings) if delays is None else delays
        everything = [aligned(epoch, used) for epoch in everything]
        fitted = [aligned(epoch, used) for epoch in fitted]
    scores = []
    for epoch, task in zip(everything, tasks, strict=True):
        if task == "sinusoid":
            scores.append(score_epoch(epoch, settings.scores, settings.estimation))
            progress(epoch.name)
    if "perturbation_nm" in estimator.needs:
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
        tuple(used),
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


def estimate(
    recording: Recording | Iterable[Epoch],
    method: str = "auto",
    *,
    settings: Settings | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Analysis:
    """Estimate J, B and K of every epoch, and score the imposed sinusoids.

    Parameters
    ----------
    recording : Recording or iterable of Epoch
    method : str
        The name of an estimator; ``auto`` chooses by what was recorded.
    settings : Settings, optional
        Instead of those of the recording.
    progress : callable
        Called with the name of each epoch once it is done.

    Returns
    -------
    Analysis
        `table()` gives its epochs as a pandas table, `pooled` the estimates of all epochs together,
        `findings` what the checks found; in a notebook it shows itself as a table.

    Raises
    ------
    ValueError
        If there is no such method.
    """
    if isinstance(recording, Recording):
        epochs: Iterable[Epoch] = recording.epochs
        settings = settings or recording.settings
    else:
        epochs = recording
    return analyse(epochs, settings or Settings(), method, progress=progress)
