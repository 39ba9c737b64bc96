"""From epochs to fits by the methods of the closed loop.

Epochs of one condition share the joint as far as instruments and noise are concerned: the pooled
estimate comes first, and single epochs use its instruments and the shape of its noise. What an
epoch says of J, B and K is its own.
"""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.stats import t as student

from rigidimeter.dynamics import DriveModel
from rigidimeter.estimation.closedloop.delay import direct
from rigidimeter.estimation.closedloop.drive_fit import fit_drive, loop_of
from rigidimeter.estimation.closedloop.instruments import LEAST, instrumental
from rigidimeter.estimation.closedloop.lack_of_fit import misfits, worst_misfit
from rigidimeter.estimation.closedloop.maximum_likelihood import output_error
from rigidimeter.estimation.closedloop.periodic_response import periodic, whole_periods
from rigidimeter.estimation.closedloop.refine import (
    ENOUGH_EPOCHS,
    SHARED_FROM,
    Linearise,
    LineFit,
    Observation,
    Problem,
    fit_pooled,
    fit_single,
)
from rigidimeter.estimation.closedloop.spectral_lines import epoch_grid, epoch_lines
from rigidimeter.estimation.method_record import Method, Progress
from rigidimeter.estimation.screening import (
    USABLE_FRACTION_OF_RATE,
    after_fit,
    before_fit,
    unusable,
)
from rigidimeter.estimation.signals import Array, motion_channels
from rigidimeter.estimation.uncertainty import Estimate
from rigidimeter.records import Channel, Epoch, Finding, Fit
from rigidimeter.settings import EstimationSettings, Settings

__all__ = [
    "CLOSED_LOOP",
    "IV",
    "ML",
    "SPECTRAL",
    "closed_loop_obstacle",
    "drives",
    "fit_closed_loop",
    "least_squares_start",
    "observe",
]

WORST_R_SQUARED = -10.0
"""A subject who pushes may turn R² negative; one far below says that a channel is wrong."""

MOST_TRIED = 5
"""So many epochs of a source may fail to show the drive before it is taken for unknown."""

CLOSED_LOOP: Mapping[str, Linearise] = {
    "iv": instrumental,
    "spectral": periodic,
    "ml": output_error,
}
"""The methods that need the perturbation, and how each makes its linear problem."""


def closed_loop_obstacle(epoch: Epoch) -> str:
    """Return why the methods of the closed loop cannot be used, or an empty text."""
    perturbation = epoch.channels.get("perturbation_nm")
    if perturbation is None:
        return "perturbation_nm was not recorded"
    if len(perturbation) < 2 or not np.all(np.isfinite(perturbation.values)):
        return "perturbation_nm holds no samples or numbers that are not finite"
    if float(np.ptp(perturbation.values)) == 0.0:
        return "perturbation_nm is constant"
    torque = epoch.channels.get("torque_nm")
    if torque is not None and np.array_equal(torque.values, perturbation.values):
        return "perturbation_nm holds the same numbers as torque_nm"
    return ""


def _even(perturbation: Channel) -> Channel:
    """Return the perturbation at every tick: the last level is held where ticks are missing."""
    spacing = np.diff(perturbation.time_s)
    interval_s = float(np.median(spacing))
    if float(np.ptp(spacing)) < 0.5 * interval_s:
        return perturbation
    count = int((perturbation.time_s[-1] - perturbation.time_s[0]) / interval_s + 0.5) + 1
    time_s = perturbation.time_s[0] + interval_s * np.arange(count)
    last = np.searchsorted(perturbation.time_s, time_s + 0.5 * interval_s, side="right") - 1
    return Channel(perturbation.name, time_s, perturbation.values[np.maximum(last, 0)])


def drives(epochs: Sequence[Epoch], settings: Settings) -> dict[str, DriveModel | None]:
    """Return the drive of each source, identified from its first epoch that allows it."""
    rig = settings.rig
    start = DriveModel(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    found: dict[str, DriveModel | None] = {}
    tried: dict[str, int] = {}
    for epoch in epochs:
        found.setdefault(epoch.source, None)
        sound = not before_fit(epoch, settings.estimation) and epoch.closed.included
        if sound and found[epoch.source] is None and tried.get(epoch.source, 0) < MOST_TRIED:
            tried[epoch.source] = tried.get(epoch.source, 0) + 1
            found[epoch.source] = fit_drive(epoch, start)
    return found


def observe(epoch: Epoch, settings: Settings, method: str, drive: DriveModel | None) -> Observation:
    """Prepare one epoch.

    Raises
    ------
    ValueError
        If the epoch cannot be used; the text says why.
    """
    obstacle = before_fit(epoch, settings.estimation) or closed_loop_obstacle(epoch)
    if obstacle:
        raise ValueError(obstacle)
    estimation, rig = settings.estimation, settings.rig
    torque, perturbation = epoch.channels["torque_nm"], _even(epoch.channels["perturbation_nm"])
    limiting = [torque] if drive is not None else [torque, *motion_channels(epoch)]
    slowest = min(channel.rate_hz for channel in limiting)
    high = min(estimation.band_high_closed_loop_hz, USABLE_FRACTION_OF_RATE * slowest)
    periods = 0

    def samples(available: int, rate_hz: float) -> int:
        nonlocal periods
        periods, count = whole_periods(perturbation, rate_hz, available)
        return count

    grid = epoch_grid(
        epoch,
        (estimation.band_low_hz, high),
        estimation.trim_s,
        samples if method == "spectral" else None,
    )
    assumed = drive or DriveModel(
        min(rig.drive_bandwidth_hz, 0.45 * perturbation.mean_rate_hz), rig.drive_damping_ratio
    )
    excited = grid.line % periods == 0 if periods else np.ones(grid.line.size, dtype=np.bool_)
    loop = loop_of(settings, torque.rate_hz, assumed)
    late_ns = round((grid.time_s[0] - perturbation.time_s[0]) * 1e9)
    sequence = hashlib.sha256(perturbation.values.tobytes()).digest()
    return Observation(
        epoch_lines(epoch, grid, drive),
        perturbation,
        loop,
        excited,
        (
            sequence,
            loop,
            late_ns,
            grid.time_s.size,
            round(1e6 * grid.rate_hz),
            int(grid.line[0]),
            int(grid.line[-1]),
        ),
    )


def fit_closed_loop(
    method: str,
    epochs: Sequence[Epoch],
    settings: Settings,
    inertia_kg_m2: float | None = None,
    progress: Progress = lambda _: None,
) -> tuple[list[Fit], list[Fit]]:
    """Fit J, B and K (or B and K at a given inertia) to every epoch and to each condition.

    Parameters
    ----------
    method : str
        A key of `CLOSED_LOOP`.
    epochs : sequence of Epoch
    settings : Settings
        Controller, rig and estimation.
    inertia_kg_m2 : float, optional
        Hold J at this value.
    progress : callable
        Called with the name of each epoch once it is done.

    Returns
    -------
    fits : list of Fit
        One for each epoch, in order; one that could not be fitted has failed, with the reason.
    pooled : list of Fit
        One for each condition with an epoch that counts, and one for all of them together where
        there are several; their `epoch` is ``pooled``.
    """
    linearise = CLOSED_LOOP[method]
    estimation = settings.estimation
    draws = estimation.bootstrap_draws if estimation.intervals == "bootstrap" else 0
    if inertia_kg_m2 is not None:
        linearise = _holding(linearise, inertia_kg_m2)
    drive_of = drives(epochs, settings)
    fits: list[Fit | None] = [None] * len(epochs)
    groups: dict[str, list[tuple[int, Observation]]] = {}
    for place, epoch in enumerate(epochs):
        try:
            observation = observe(epoch, settings, method, drive_of[epoch.source])
        except ValueError as error:
            fits[place] = _without_numbers(epoch, method, str(error))
            progress(epoch.name)
            continue
        groups.setdefault(epoch.condition, []).append((place, observation))
    pooled = []
    counting: list[tuple[int, Observation]] = []
    for condition, members in groups.items():
        good = [member for member in members if epochs[member[0]].closed.included]
        counting += good
        start = least_squares_start([observation for _, observation in (good or members)])
        start = start if inertia_kg_m2 is None else start[1:]
        shared: LineFit | None = None
        made: dict[int, Problem] = {}
        if good:
            try:
                shared, problems = fit_pooled([o for _, o in good], linearise, start, draws)
            except ValueError:
                shared = None  # each epoch will say why
            else:
                made = {place: p for (place, _), p in zip(good, problems, strict=True)}
                pooled.append(_pooled_fit(method, condition, shared, good, epochs, inertia_kg_m2))
        singles: dict[int, LineFit] = {}
        for place, observation in members:
            epoch = epochs[place]
            share = shared if shared is not None and len(good) >= SHARED_FROM else None
            reuse = made.get(place) if method != "ml" else None
            try:
                fit = fit_single(
                    observation,
                    linearise,
                    shared.values if shared is not None else start,
                    share.shape if share is not None else None,
                    reuse if share is not None else None,
                    draws,
                )
            except ValueError as error:
                fits[place] = _without_numbers(epoch, method, str(error))
            else:
                fits[place] = _epoch_fit(epoch, method, fit, observation, inertia_kg_m2)
                singles[place] = fit
            progress(epoch.name)
        if shared is not None:
            finding = _misfit(good, made, singles, settings)
            if finding is not None:
                pooled[-1] = replace(pooled[-1], findings=(finding,))
    if len(groups) > 1 and counting:
        start = least_squares_start([observation for _, observation in counting])
        start = start if inertia_kg_m2 is None else start[1:]
        try:
            everything, _ = fit_pooled([o for _, o in counting], linearise, start, draws)
        except ValueError:
            pass  # as the conditions have
        else:
            pooled.append(_pooled_fit(method, "", everything, counting, epochs, inertia_kg_m2))
    return [fit for fit in fits if fit is not None], pooled


def _misfit(
    good: Sequence[tuple[int, Observation]],
    made: Mapping[int, Problem],
    singles: Mapping[int, LineFit],
    settings: Settings,
) -> Finding | None:
    """Return what the epochs of the commonest sequence leave of their response to it."""
    groups: dict[Hashable, list[int]] = {}
    for place, observation in good:
        if place in singles:
            groups.setdefault(observation.response_key, []).append(place)
    places = max(groups.values(), key=len, default=[])
    of_place = dict(good)
    parts = misfits(
        [of_place[place] for place in places],
        [made[place] for place in places],
        [singles[place] for place in places],
    )
    return worst_misfit(parts, settings.diagnostics)


def _holding(linearise: Linearise, inertia_kg_m2: float) -> Linearise:
    """Return the problems of B and K alone (Eq. 7)."""

    def held(observations: Sequence[Observation], values: Array) -> list[Problem]:
        full = linearise(observations, np.concatenate(([inertia_kg_m2], values)))
        return [
            Problem(
                problem.instruments[:, 1:],
                problem.regressors[:, 1:],
                problem.target - inertia_kg_m2 * problem.regressors[:, 0],
            )
            for problem in full
        ]

    return held


def least_squares_start(observations: Sequence[Observation]) -> Array:
    """Return where to begin: least squares, kept where the loop can be simulated; shape (3,)."""
    gram, moment = np.zeros((3, 3)), np.zeros(3)
    for problem in direct(observations, np.empty(0)):
        gram += (problem.regressors.conj().T @ problem.regressors).real
        moment += (problem.regressors.conj().T @ problem.target).real
    scale = np.sqrt(np.maximum(np.diag(gram), np.finfo(np.float64).tiny))
    values = np.linalg.lstsq(gram / np.outer(scale, scale), moment / scale)[0] / scale
    return np.asarray(np.maximum(values, 10 * LEAST), dtype=np.float64)


def _estimate(fit: LineFit, inertia_kg_m2: float | None) -> Estimate:
    """Return J, B and K with their uncertainty, as a `Fit` holds them."""
    bound = np.sqrt(np.diag(fit.bound))
    if fit.drawn is not None:
        covariance = np.atleast_2d(np.cov(fit.drawn, rowvar=False))
        low, high = np.quantile(fit.drawn, [0.025, 0.975], axis=0)
        found = Estimate(
            fit.values, np.std(fit.drawn, axis=0, ddof=1), low, high, bound, covariance
        )
    else:
        half = student.ppf(0.975, fit.degrees) * fit.standard_errors
        ends = fit.values - half, fit.values + half
        found = Estimate(fit.values, fit.standard_errors, *ends, bound, fit.covariance)
    return found if inertia_kg_m2 is None else found.with_inertia(inertia_kg_m2)


def _epoch_fit(
    epoch: Epoch,
    method: str,
    fit: LineFit,
    observation: Observation,
    inertia_kg_m2: float | None,
) -> Fit:
    found = _estimate(fit, inertia_kg_m2)
    lines = observation.lines
    left = lines.torque_nm - lines.motion @ found.value
    share = float(np.sum(np.abs(left) ** 2) / np.sum(np.abs(lines.torque_nm) ** 2))
    grid = lines.grid
    residual_sd = np.sqrt(2 * np.sum(np.abs(left) ** 2) / (grid.time_s.size * grid.energy))
    return Fit(
        source=epoch.source,
        epoch=epoch.label,
        condition=epoch.condition,
        method=method,
        outcome=after_fit(
            epoch, 1.0 - share, fit.condition_number, least_r_squared=WORST_R_SQUARED
        ),
        r_squared=1.0 - share,
        vaf_percent=100.0 * (1.0 - share),
        condition_number=fit.condition_number,
        residual_sd_nm=float(residual_sd),
        n_samples=grid.time_s.size,
        band_hz=grid.band_hz,
        **found._asdict(),
    )


def _pooled_fit(
    method: str,
    condition: str,
    fit: LineFit,
    members: Sequence[tuple[int, Observation]],
    epochs: Sequence[Epoch],
    inertia_kg_m2: float | None,
) -> Fit:
    """Return the estimate from all epochs of a condition; its statistics are over all of them."""
    singles = [
        _epoch_fit(epochs[place], method, fit, observation, inertia_kg_m2)
        for place, observation in members
    ]
    sources = dict.fromkeys(single.source for single in singles)
    weight = np.array([single.n_samples for single in singles], dtype=np.float64)
    power = np.array([single.residual_sd_nm**2 for single in singles])
    total = power / (1 - np.array([single.r_squared for single in singles]))
    share = float(weight @ power / (weight @ total))
    return replace(
        singles[0],
        source=", ".join(sources),
        epoch="pooled",
        condition=condition,
        r_squared=1 - share,
        vaf_percent=100 * (1 - share),
        residual_sd_nm=float(np.sqrt(weight @ power / weight.sum())),
        n_samples=int(weight.sum()),
    )


def _without_numbers(epoch: Epoch, method: str, reason: str) -> Fit:
    return Fit(
        source=epoch.source,
        epoch=epoch.label,
        condition=epoch.condition,
        method=method,
        outcome=unusable(epoch, reason),
    )


def _intervals_text(settings: EstimationSettings) -> str:
    if settings.intervals == "bootstrap":
        return (
            "Intervals are made by giving each spectral line of the residual a new phase, the "
            "subject’s own torque included"
        )
    return (
        "Intervals are made from the power of the residual at each frequency, the subject’s own "
        "torque included"
    )


_POOLED_TEXT = (
    f"From {ENOUGH_EPOCHS} epochs on they come from the scatter between epochs; with fewer, the "
    "joint is taken for one that does not change, and where epochs differ by more than their own "
    "intervals these are too narrow"
)

IV = Method(
    name="iv",
    title="instrumental variables, made from the perturbation",
    needs=("perturbation_nm",),
    methods_text="by refined instrumental variables made from the known perturbation",
    fit=partial(fit_closed_loop, "iv"),
    references=("riv", "riv_loop"),
    intervals_text=_intervals_text,
    pooled_text=_POOLED_TEXT,
    in_sensitivity=True,
)
SPECTRAL = Method(
    name="spectral",
    title="instrumental variables at the lines of a periodic perturbation",
    needs=("perturbation_nm",),
    methods_text="by instrumental variables at the lines of the periodic perturbation",
    fit=partial(fit_closed_loop, "spectral"),
    intervals_text=_intervals_text,
    pooled_text=_POOLED_TEXT,
)
ML = Method(
    name="ml",
    title="maximum likelihood of the torque that the perturbation causes in the whole loop",
    needs=("perturbation_nm",),
    methods_text="by maximum likelihood of the torque that the perturbation causes in the whole "
    "loop",
    fit=partial(fit_closed_loop, "ml"),
    intervals_text=_intervals_text,
    pooled_text=_POOLED_TEXT,
)
