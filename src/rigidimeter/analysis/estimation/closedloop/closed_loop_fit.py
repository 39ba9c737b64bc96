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

from rigidimeter.analysis.estimation.amplitude import amplitude_of_lines, amplitude_together
from rigidimeter.analysis.estimation.closedloop.between_uncertainty import (
    between_samples,
    moved_elsewhere,
)
from rigidimeter.analysis.estimation.closedloop.line_noise import power_on
from rigidimeter.analysis.estimation.closedloop.linear_problems import (
    Linearise,
    holding,
    least_squares_start,
)
from rigidimeter.analysis.estimation.closedloop.loop_pull import loop_pull
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.closedloop.refine import LineFit, fit_at, fit_lines
from rigidimeter.analysis.estimation.method_record import Progress
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.screening import after_fit, unusable
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.analysis.estimation.uncertainty import of_fit
from rigidimeter.core.records import Epoch, Fit

WORST_R_SQUARED = -10.0
"""A subject who pushes may turn R² negative; one far below says that a channel is wrong."""

SHARED_FROM = 4
"""From this many epochs on, they share the shape of their noise."""

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
    if inertia_kg_m2 is not None:
        method = method._replace(linearise=holding(method.linearise, inertia_kg_m2))
    fits: dict[PreparedEpoch, Fit] = {}
    groups: dict[str, list[PreparedEpoch]] = {}
    for epoch in epochs:
        try:
            epoch.once(method.observe)
        except ValueError as error:
            fits[epoch] = _without_numbers(epoch.epoch, method.name, str(error))
            progress(1.0)
        else:
            groups.setdefault(epoch.epoch.condition, []).append(epoch)
    of_conditions = []
    for condition, members in groups.items():
        good = [member for member in members if member.epoch.closed.included]
        places = {member: place for place, member in enumerate(good)}
        start = _start(method, good or members, inertia_kg_m2)
        shared = _shared(method, good, start)
        progress(POOLED_SHARE * len(members))
        # Few epochs do not know the shape of their noise together any better than each alone.
        known = shared if len(good) >= SHARED_FROM else None
        for member in members:
            try:
                if known is not None and member in places:
                    place = places[member]
                    fit = fit_at([known.problems[place]], [known.powers[place]])
                else:
                    fit = _alone(method, member, start if shared is None else shared.values, known)
            except ValueError as error:
                fits[member] = _without_numbers(member.epoch, method.name, str(error))
            else:
                fits[member] = _fit_of(method, [member], fit, inertia_kg_m2)
            progress(1.0 - POOLED_SHARE)
        if pooled and shared is not None:
            together = _fit_of(method, good, shared, inertia_kg_m2)
            of_conditions.append(replace(together, epoch="pooled", condition=condition))
    if pooled and len(groups) > 1:
        counting = [m for members in groups.values() for m in members if m.epoch.closed.included]
        start = _start(method, counting, inertia_kg_m2) if counting else np.empty(0)
        everything = _shared(method, counting, start)
        if everything is not None:
            found = _fit_of(method, counting, everything, inertia_kg_m2)
            of_conditions.append(replace(found, epoch="pooled", condition="", findings=()))
    return [fits[epoch] for epoch in epochs], of_conditions


def _start(
    method: LineMethod, members: Sequence[PreparedEpoch], inertia_kg_m2: float | None
) -> Array:
    start = least_squares_start([member.once(method.observe) for member in members])
    return start if inertia_kg_m2 is None else start[1:]


def _shared(method: LineMethod, members: Sequence[PreparedEpoch], start: Array) -> LineFit | None:
    """Return what the epochs that count share; None where there is none, as each epoch will say."""
    if not members:
        return None
    observations = [member.once(method.observe) for member in members]
    try:
        return fit_lines(observations, method.linearise, start)
    except ValueError:
        return None


def _alone(
    method: LineMethod, member: PreparedEpoch, start: Array, known: LineFit | None
) -> LineFit:
    """Return the fit of an epoch that shares no instruments, weighted as others where these do."""
    observation = member.once(method.observe)
    powers = None
    if known is not None:
        first = known.problems[0].observation.grid
        powers = [power_on(observation.grid, first, known.powers[0])]
    return fit_lines([observation], method.linearise, start, powers)


def _fit_of(
    method: LineMethod,
    members: Sequence[PreparedEpoch],
    fit: LineFit,
    inertia_kg_m2: float | None,
) -> Fit:
    """Return a fit as it is recorded, named after the first of its epochs."""
    epoch, observations = members[0].epoch, [member.once(method.observe) for member in members]
    between = moved_elsewhere(fit)
    pulled = np.nan_to_num(np.abs(loop_pull(fit.problems, fit.powers, fit.values, fit.inverse)))
    numbers = of_fit(
        fit.values,
        fit.covariance,
        fit.degrees,
        np.sqrt(np.diag(fit.bound)),
        inertia_kg_m2,
        between + pulled,
    )
    moved = [
        amplitude_of_lines(member.epoch, one)
        for member, one in zip(members, observations, strict=True)
    ]
    counts = [one.grid.samples for one in observations]
    left, total = np.zeros(2)
    for one, count in zip(observations, counts, strict=True):
        grid, torque = one.grid, one.torque_nm
        per_line = 2 * count / (grid.time_s.size * grid.energy)
        left += per_line * np.sum(np.abs(torque - one.motion @ numbers["value"]) ** 2)
        total += per_line * np.sum(np.abs(torque) ** 2)
    r_squared = 1.0 - float(left / total)
    return Fit(
        source=", ".join(dict.fromkeys(member.epoch.source for member in members)),
        epoch=epoch.label,
        condition=epoch.condition,
        method=method.name,
        outcome=after_fit(epoch, r_squared, fit.condition_number, least_r_squared=WORST_R_SQUARED),
        r_squared=r_squared,
        vaf_percent=100.0 * r_squared,
        condition_number=fit.condition_number,
        residual_sd_nm=float(np.sqrt(left / sum(counts))),
        n_samples=sum(counts),
        band_hz=observations[0].grid.band_hz,
        findings=between_samples(
            epoch, observations[0], fit.values, between, fit.standard_errors, members[0].settings
        ),
        **numbers,
        **amplitude_together(moved, counts)._asdict(),
    )


def _without_numbers(epoch: Epoch, method: str, reason: str) -> Fit:
    return Fit(
        source=epoch.source,
        epoch=epoch.label,
        condition=epoch.condition,
        method=method,
        outcome=unusable(epoch, reason),
    )
