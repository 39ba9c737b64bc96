"""What least squares of the measured motion assumes: a known loop, and a joint of J, B and K.

Torque u that something but the robot adds pulls least squares by b (`closedloop.loop_pull`). Where
each line counts by its noise, b is small and in the interval; where lines count alike it is not.

Weights do not change what noise and the loop alone leave: with p₀ the solution in which lines count
alike, b₀ its pull and p̂ the weighted one,

    p₀ − b₀ − p̂

is then zero but for the standard error of p₀, which is the larger (Hausman 1978). What the model
lacks, such as a reflex, has other sizes at other frequencies, so the two solutions differ.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.estimation.closedloop.line_noise import Solved, smoother_for
from rigidimeter.analysis.estimation.closedloop.linear_problems import direct, least_squares
from rigidimeter.analysis.estimation.closedloop.loop_pull import loop_pull
from rigidimeter.analysis.estimation.closedloop.normal_equations import scaled_inverse, sums
from rigidimeter.analysis.estimation.closedloop.observe import observe_motion
from rigidimeter.analysis.estimation.closedloop.refine import shared_powers
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    HARMFUL,
    Case,
    Check,
    Harmless,
    Look,
    too_biased,
)
from rigidimeter.analysis.estimation.found import half_widths
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import Effect
from rigidimeter.core.records import Fit
from rigidimeter.core.settings import DiagnosticsSettings

STANDARD_ERRORS = 4.0
"""So far may the two solutions be apart by chance, of whichever of J, B and K."""

PULL_SHARE = 0.5
"""And by this share of b₀, which is computed from the residual of one epoch."""

MOST_NOISE = 50.0
"""In %. Then as much of what decides J or B is noise as is motion."""


def unbiased(prepared: PreparedEpoch, fit: Fit, by_noise: bool) -> Array | None:
    """Return J, B and K by least squares without the pull of the loop; NaN where it is too large.

    None where no loop is known.

    Parameters
    ----------
    prepared : PreparedEpoch
    fit : Fit
        Where lines count by their noise, the solution.
    by_noise : bool
        Or all lines count alike.
    """
    observation = prepared.once(observe_motion)
    if observation.loop is None:
        return None
    problems = direct([observation], fit.value)
    if by_noise:
        values, powers = fit.value, shared_powers(problems, fit.value)
    else:
        values, powers = least_squares(problems), [np.ones(observation.torque_nm.size)]
    try:
        inverse = scaled_inverse(sums(problems, powers).gram)
    except ValueError:
        return np.full(3, np.nan)
    return values - loop_pull(problems, powers, values, inverse)


def loop_bias(
    fit: Fit, without_pull: Array, in_interval: bool, settings: DiagnosticsSettings
) -> Look:
    """Return how far the loop pulls least squares from the joint, in % of half the intervals."""
    bias = fit.value - without_pull
    value = 100.0 * float(np.max(np.abs(bias) / half_widths(fit)))
    most = settings.max_loop_bias_percent
    if not np.isfinite(value):
        return Look(value, most, True, variant="unknown")
    large = too_biased(bias, fit.value, half_widths(fit), most, in_interval)
    effect = Effect.of(bias, fit.value, half_widths(fit))
    return Look(value, most, large, variant="first_order" if in_interval else "", effect=effect)


class _Unweighted(NamedTuple):
    """J, B and K without weights, the pull of the loop taken off, and how far chance may put it."""

    values: Array
    allowed: Array


def _unweighted(case: Case) -> _Unweighted | None:
    """Return that of a method that weights; None for others, and where the pull is too large."""
    if case.fit is None or case.prepared is None or not case.bias_in_interval:
        return None
    if case.uses_perturbation:
        return None
    observation = case.prepared.once(observe_motion)
    problems, grid = direct([observation], case.parameters), observation.grid
    gram, moment, (instruments,) = sums(problems)
    inverse = scaled_inverse(gram)
    alike = inverse @ moment
    pull = loop_pull(problems, [np.ones(grid.line.size)], alike, inverse)
    if not np.all(np.isfinite(pull)):
        return None
    (shape,) = shared_powers(problems, alike)
    residual = problems[0].target - problems[0].regressors @ alike
    smoother = smoother_for(grid.line, 1)
    solved = Solved(inverse, instruments, problems[0].regressors, shape, grid.spread)
    covariance, _ = solved.covariance(solved.density(residual, smoother), smoother)
    chance = STANDARD_ERRORS * np.sqrt(np.diag(covariance))
    return _Unweighted(alike - pull, chance + PULL_SHARE * np.abs(pull))


def unweighted_fit(case: Case) -> Look | None:
    """Return by how many % least squares without weights differs, more than noise and loop do."""
    found = case.once(_unweighted)
    if found is None:
        return None
    apart = found.values - case.parameters
    percent = 100.0 * apart / np.abs(case.parameters)
    most = case.settings.max_unweighted_percent
    sure = (np.abs(apart) > found.allowed) & (np.abs(percent) > most)
    about = int(np.argmax(np.where(sure, np.abs(percent), -1.0)))
    facts = {"symbol": "JBK"[about], "way": "higher" if percent[about] > 0 else "lower"}
    return Look(float(abs(percent[about])), most, bool(np.any(sure)), facts)


def noise_of_motion(case: Case) -> Look | None:
    """Return how much of the motion that decides J or B is noise, in %.

    Half the difference of what even and odd samples give is the noise of their mean. With its power
    |n|² and that of the motion |φ|², both weighted, the share is Σ |n|²/S ÷ Σ |φ|²/S. What
    neighbouring samples share, as behind a filter, it does not show.
    """
    if case.fit is None or case.prepared is None or not case.bias_in_interval:
        return None
    if case.uses_perturbation:
        return None
    observation = case.prepared.once(observe_motion)
    if observation.noise is None:
        return None
    (power,) = shared_powers(direct([observation], case.parameters), case.parameters)
    of_noise, of_motion = (
        np.sum(np.abs(lines[:, :2]) ** 2 / power[:, None], axis=0)
        for lines in (observation.noise, observation.motion)
    )
    share = 100.0 * of_noise / of_motion
    about = int(np.argmax(share))
    value = float(share[about])
    return Look(value, MOST_NOISE, value > MOST_NOISE, {"symbol": "JB"[about]})


def _loop_bias(case: Case) -> Look | None:
    if case.fit is None or case.uses_perturbation or case.prepared is None:
        return None
    if case.unbiased is None:
        return Look(np.nan, case.settings.max_loop_bias_percent, True)
    return loop_bias(case.fit, case.unbiased, case.bias_in_interval, case.settings)


def _not_known(case: Case, look: Look) -> Harmless:
    """Return the variant for a loop that is not known: a note, since nothing is computed."""
    del look
    return ("not_known", {}) if case.unbiased is None else HARMFUL


LEAST_SQUARES_CHECKS = (
    Check("loop_bias", (), _loop_bias, harmless=_not_known),
    Check("unweighted_fit", (), unweighted_fit),
    Check("noise_of_motion", (), noise_of_motion),
)
