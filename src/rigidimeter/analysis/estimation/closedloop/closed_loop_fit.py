"""From epochs to fits by the methods of the closed loop.

Epochs of one condition share the joint as far as instruments and noise are concerned: the pooled
estimate comes first, and single epochs use its instruments and the shape of its noise. What an
epoch says of J, B and K is its own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.amplitude import amplitude_of_lines, amplitude_together
from rigidimeter.analysis.estimation.closedloop.between_uncertainty import between_samples
from rigidimeter.analysis.estimation.closedloop.linear_problems import (
    Linearise,
    Problem,
    holding,
    least_squares_start,
)
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.closedloop.refine import (
    SHARED_FROM,
    LineFit,
    fit_pooled,
    fit_single,
)
from rigidimeter.analysis.estimation.method_record import Progress
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.screening import after_fit, unusable
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.analysis.estimation.uncertainty import Estimate
from rigidimeter.core.records import Epoch, Fit
from rigidimeter.core.settings import Settings

WORST_R_SQUARED = -10.0
"""A subject who pushes may turn R² negative; one far below says that a channel is wrong."""

POOLED_SHARE = 0.9
"""The share of the work that is done once the epochs of a condition are fitted together."""


class LineMethod(NamedTuple):
    """A method of the closed loop.

    Attributes
    ----------
    name : str
    observe : callable
        Makes the lines of an epoch.
    linearise : callable
        Makes the linear problems at given parameters.
    """

    name: str
    observe: Callable[[PreparedEpoch], Observation]
    linearise: Linearise


class _Member(NamedTuple):
    """An epoch that could be observed, and its place among all."""

    place: int
    epoch: Epoch
    observation: Observation


def fit_closed_loop(
    method: LineMethod,
    epochs: Sequence[PreparedEpoch],
    inertia_kg_m2: float | None = None,
    progress: Progress = lambda _: None,
    pooled: bool = True,
) -> tuple[list[Fit], list[Fit]]:
    """Fit J, B and K (or B and K at a given inertia) to every epoch and to each condition.

    Parameters and values are those of `method_record.FitEpochs`.
    """
    fits: dict[int, Fit] = {}
    groups: dict[str, list[_Member]] = {}
    for place, prepared in enumerate(epochs):
        try:
            observation = prepared.once(method.observe)
        except ValueError as error:
            fits[place] = _without_numbers(prepared.epoch, method.name, str(error))
            progress(1.0)
            continue
        member = _Member(place, prepared.epoch, observation)
        groups.setdefault(prepared.epoch.condition, []).append(member)
    of_conditions = []
    for condition, members in groups.items():
        settings = epochs[members[0].place].settings
        own, together = _fit_condition(
            method, condition, members, settings, inertia_kg_m2, progress
        )
        fits |= own
        of_conditions += together
    if pooled and len(groups) > 1:
        counting = [m for members in groups.values() for m in members if m.epoch.closed.included]
        of_conditions += _fit_all(method, counting, epochs[0].settings, inertia_kg_m2)
    return [fits[place] for place in range(len(epochs))], of_conditions if pooled else []


def _fit_condition(
    method: LineMethod,
    condition: str,
    members: Sequence[_Member],
    settings: Settings,
    inertia_kg_m2: float | None,
    progress: Progress,
) -> tuple[dict[int, Fit], list[Fit]]:
    """Return the fit of each epoch of a condition, and that of all of them that count."""
    linearise = _problems(method, inertia_kg_m2)
    good = [member for member in members if member.epoch.closed.included]
    start = _start(good or members, inertia_kg_m2)
    shared: LineFit | None = None
    made: dict[int, Problem] = {}
    if good:
        try:
            shared, problems = fit_pooled([m.observation for m in good], linearise, start)
        except ValueError:
            pass  # each epoch will say why
        else:
            made = {member.place: p for member, p in zip(good, problems, strict=True)}
    progress(POOLED_SHARE * len(members))
    # Few epochs do not know the shape of their noise together any better than each alone.
    share = shared if len(good) >= SHARED_FROM else None
    fits: dict[int, Fit] = {}
    for place, epoch, observation in members:
        try:
            fit = fit_single(
                observation,
                linearise,
                shared.values if shared is not None else start,
                share.shape if share is not None else None,
                made.get(place) if share is not None else None,
            )
        except ValueError as error:
            fits[place] = _without_numbers(epoch, method.name, str(error))
        else:
            found = _epoch_fit(epoch, method.name, fit, observation, inertia_kg_m2)
            unsettled = between_samples(
                epoch, observation, fit.values, fit.between, settings.diagnostics
            )
            fits[place] = replace(found, findings=unsettled)
        progress(1.0 - POOLED_SHARE)
    if shared is None:
        return fits, []
    together = _pooled_fit(method.name, condition, shared, good, inertia_kg_m2)
    unsettled = between_samples(
        good[0].epoch, good[0].observation, shared.values, shared.between, settings.diagnostics
    )
    return fits, [replace(together, findings=unsettled)]


def _fit_all(
    method: LineMethod,
    members: Sequence[_Member],
    settings: Settings,
    inertia_kg_m2: float | None,
) -> list[Fit]:
    """Return the fit of the epochs of all conditions, if there is one."""
    if not members:
        return []
    linearise, start = _problems(method, inertia_kg_m2), _start(members, inertia_kg_m2)
    observations = [member.observation for member in members]
    try:
        everything, _ = fit_pooled(observations, linearise, start)
    except ValueError:
        return []  # the epochs have said why
    return [_pooled_fit(method.name, "", everything, members, inertia_kg_m2)]


def _problems(method: LineMethod, inertia_kg_m2: float | None) -> Linearise:
    return method.linearise if inertia_kg_m2 is None else holding(method.linearise, inertia_kg_m2)


def _start(members: Sequence[_Member], inertia_kg_m2: float | None) -> Array:
    start = least_squares_start([member.observation for member in members])
    return start if inertia_kg_m2 is None else start[1:]


def _estimate(fit: LineFit, inertia_kg_m2: float | None) -> Estimate:
    """Return J, B and K with their uncertainty, as a `Fit` holds them."""
    bound = np.sqrt(np.diag(fit.bound))
    away = fit.between + np.nan_to_num(np.abs(fit.pulled))
    half = scipy.special.stdtrit(fit.degrees, 0.975) * fit.standard_errors + away
    low, high = fit.values - half, fit.values + half
    found = Estimate(fit.values, fit.standard_errors, low, high, bound, fit.covariance)
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
        n_samples=int(np.count_nonzero(grid.window)),
        band_hz=grid.band_hz,
        **found._asdict(),
        **amplitude_of_lines(epoch, lines)._asdict(),
    )


def _pooled_fit(
    method: str,
    condition: str,
    fit: LineFit,
    members: Sequence[_Member],
    inertia_kg_m2: float | None,
) -> Fit:
    """Return the estimate from all epochs of a condition; its statistics are over all of them."""
    singles = [
        _epoch_fit(member.epoch, method, fit, member.observation, inertia_kg_m2)
        for member in members
    ]
    sources = dict.fromkeys(single.source for single in singles)
    weight = np.array([single.n_samples for single in singles], dtype=np.float64)
    power = np.array([single.residual_sd_nm**2 for single in singles])
    unexplained = 1 - np.array([single.r_squared for single in singles])
    total = power / np.maximum(unexplained, np.finfo(np.float64).tiny)
    share = float(weight @ power / max(weight @ total, np.finfo(np.float64).tiny))
    return replace(
        singles[0],
        source=", ".join(sources),
        epoch="pooled",
        condition=condition,
        r_squared=1 - share,
        vaf_percent=100 * (1 - share),
        residual_sd_nm=float(np.sqrt(weight @ power / weight.sum())),
        n_samples=int(weight.sum()),
        **amplitude_together(singles)._asdict(),
    )


def _without_numbers(epoch: Epoch, method: str, reason: str) -> Fit:
    return Fit(
        source=epoch.source,
        epoch=epoch.label,
        condition=epoch.condition,
        method=method,
        outcome=unusable(epoch, reason),
    )
