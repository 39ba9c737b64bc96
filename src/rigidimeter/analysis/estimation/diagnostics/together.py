"""What the epochs of a condition show together: lack of fit, other bands, bias of their pool.

The lack of fit and the sensitivity to the band are matters of the joint, not of an epoch, so each
epoch of the condition carries what was found. They are tested at the J, B and K that the
perturbation gives, for every method: at those of least squares the subject's own torque would show
in the residual as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.estimation.closedloop.band_sensitivity import (
    BandChange,
    Member,
    band_changes,
    band_estimates,
    band_finding,
)
from rigidimeter.analysis.estimation.closedloop.grid import Complex
from rigidimeter.analysis.estimation.closedloop.lack_of_fit import (
    Answer,
    Misfit,
    periodic,
    proportional,
    repeated,
    same_sequence,
)
from rigidimeter.analysis.estimation.closedloop.linear_problems import LEAST
from rigidimeter.analysis.estimation.closedloop.normal_equations import (
    Problem,
    solution,
    sums,
)
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.closedloop.observe import observe, observe_periods
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import closed_loop_obstacle
from rigidimeter.analysis.estimation.diagnostics.least_squares_checks import loop_bias, unbiased
from rigidimeter.analysis.estimation.found import found, in_half_intervals
from rigidimeter.analysis.estimation.method_record import Method
from rigidimeter.analysis.estimation.methods import method_named
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import BandEstimate, Fit
from rigidimeter.core.settings import DiagnosticsSettings

CHANCE = 1e-4
"""Probability, over all parts of all tests of a condition, below which it is not noise."""


class Together(NamedTuple):
    """Fits, and fits to all epochs of a condition, with what epochs show together; other bands."""

    fits: list[Fit]
    pooled: list[Fit]
    sensitivity: list[BandEstimate]


def checked_together(
    prepared: Sequence[PreparedEpoch], fits: Sequence[Fit], pooled: Sequence[Fit], estimator: Method
) -> Together:
    """Return the fits, and the pooled fits, with what the epochs of each condition show together.

    Parameters
    ----------
    prepared, fits : sequences
        In parallel; those fits that do not count are not looked at.
    pooled : sequence of Fit
        Of the conditions, and of all of them.
    estimator : Method
        That made them.
    """
    counting = [(p, f) for p, f in zip(prepared, fits, strict=True) if f.outcome.included]
    of_condition: dict[str, list[Finding]] = {}
    changes: dict[str, list[BandChange]] = {}
    sensitivity: list[BandEstimate] = []
    for condition in dict.fromkeys(fit.condition for _, fit in counting):
        members = [(p, f) for p, f in counting if f.condition == condition]
        observed, tests = misfits(members, estimator)
        settings = members[0][0].settings.diagnostics
        of_condition[condition] = lack_of_fit(tests, observed, settings)
        values, changes[condition] = in_bands(observed)
        whole = [f for f in pooled if f.condition == condition and estimator.uses_perturbation]
        sensitivity += band_estimates(
            condition, whole[0] if whole else None, values, changes[condition]
        )

    def shared(fit: Fit) -> list[Finding]:
        if fit.condition not in of_condition:
            return []
        settings = counting[0][0].settings.diagnostics
        bands = band_finding(fit, changes[fit.condition], settings)
        epochs = tuple(one.epoch for _, one in counting if one.condition == fit.condition)
        return [
            replace(one, condition=fit.condition, epochs=epochs)
            for one in (*of_condition[fit.condition], *bands)
        ]

    alone = [_with(fit, shared(fit)) if fit.outcome.included else fit for fit in fits]
    own = [_with(fit, [*shared(fit), *_pooled_bias(fit, counting, estimator)]) for fit in pooled]
    return Together(alone, [_with(fit, _of_every(fit, alone)) for fit in own], sensitivity)


def in_bands(observed: Sequence[Member]) -> tuple[Array, list[BandChange]]:
    """Return J, B and K of epochs together, and how they change in other bands.

    Parameters
    ----------
    observed : sequence of Member
        As `misfits` gives them.
    """
    try:
        return band_changes(observed) if observed else (np.full(3, np.nan), [])
    except ValueError:
        return np.full(3, np.nan), []  # the fits say why


def misfits(
    members: Sequence[tuple[PreparedEpoch, Fit]], estimator: Method
) -> tuple[list[Member], list[Misfit]]:
    """Return the epochs in which the lack of fit can be seen, and what each test says of them.

    Parameters
    ----------
    members : sequence of (PreparedEpoch, Fit)
        Epochs of one condition that count; those without a perturbation are passed over.
    estimator : Method
        That made the fits.
    """
    known = [(p, f) for p, f in members if not closed_loop_obstacle(p.epoch)]
    if not estimator.uses_perturbation and known:
        by_iv, _ = method_named("iv").fit([p for p, _ in known], None, lambda _: None, False)
        known = [(p, fit) for (p, _), fit in zip(known, by_iv, strict=True) if fit.outcome.included]
    if not known:
        return [], []
    values = np.array([fit.value for _, fit in known])
    common = np.maximum(np.median(values, axis=0), LEAST)
    observed: list[Member] = []
    made: dict[tuple[int, int], Complex] = {}
    for (epoch, _), own in zip(known, values, strict=True):
        try:
            observed.append(_member(epoch.once(observe), own, common, made))
        except ValueError:
            continue  # the fit of the epoch says why
    if not observed:
        return [], []
    return observed, _tested(list(map(_answer, observed)), known[0], common)


def _member(
    observation: Observation, values: Array, common: Array, made: dict[tuple[int, int], Complex]
) -> Member:
    """Return an epoch as observed; `made` keeps what each perturbation causes, made once."""
    excitation, seen = observation.excitation, observation.wider or observation
    assert excitation is not None  # `observe` gives it
    J, B, K = common.tolist()
    key = id(excitation), seen.grid.line.size
    if key not in made:
        made[key] = replace(excitation, grid=seen.grid).motion_lines((J, B, K))
    problem = Problem(made[key], seen.motion, seen.torque_nm, observation)
    return Member(problem, values)


def _answer(member: Member) -> Answer:
    """Return what the lack of fit is tested with."""
    seen = member.problem.observation
    caused = member.problem.instruments[member.fitted]
    residual = seen.torque_nm - seen.motion @ member.values
    return Answer(seen, caused @ np.maximum(member.values, LEAST), residual)


def _tested(
    answers: Sequence[Answer], first: tuple[PreparedEpoch, Fit], common: Array
) -> list[Misfit]:
    """Return what each test finds: those of sequences need two epochs or two periods."""
    tested = proportional(answers)
    together = max(same_sequence(answers), key=len)
    if len(together) > 1:
        return tested + repeated(together)
    prepared, fit = first
    try:
        periods = prepared.once(observe_periods)
    except ValueError:
        return tested  # there are not two periods
    return tested + periodic(_answer(_member(periods, fit.value, common, {})), periods.excited)


def lack_of_fit(
    tested: Sequence[Misfit], observed: Sequence[Member], settings: DiagnosticsSettings
) -> list[Finding]:
    """Return the finding for the part with the largest misfit that is not noise, if any.

    Parameters
    ----------
    tested : sequence of Misfit
    observed : sequence of Member
        As `misfits` gives them.
    settings : DiagnosticsSettings
    """
    most = settings.max_lack_of_fit_percent
    sure = [part for part in tested if part.p * len(tested) < CHANCE and 100 * part.share > most]
    if not sure:
        return []
    worst = max(sure, key=lambda part: part.share)
    half = zip(("half_J", "half_B", "half_K"), _in_half_the_band(observed).tolist(), strict=True)
    facts = {"low_hz": worst.low_hz, "high_hz": worst.high_hz, **dict(half)}
    return [found("lack_of_fit", settings, 100 * worst.share, most, p=worst.p, facts=facts)]


def _in_half_the_band(observed: Sequence[Member]) -> Array:
    """Return by how many % J, B and K change if only the lower half of the band is fitted."""
    both = []
    for share in (1.0, 0.5):
        problems, powers = [], []
        for member in observed:
            start, stop = member.fitted.start, member.fitted.stop
            part = slice(start, start + int(share * (stop - start)))
            instruments, motion, torque = (of_lines[part] for of_lines in member.problem[:3])
            problems.append(Problem(instruments, motion, torque, member.problem.observation))
            power = np.mean(np.abs(torque - motion @ member.values) ** 2)
            powers.append(np.full(torque.size, power))
        gram, moment, _ = sums(problems, powers)
        both.append(solution(gram, moment))
    return np.asarray(100 * (both[1] / both[0] - 1))


def _pooled_bias(
    fit: Fit, counting: Sequence[tuple[PreparedEpoch, Fit]], estimator: Method
) -> list[Finding]:
    """Return the bias of a pooled fit by least squares, where it is more than its interval."""
    if estimator.uses_perturbation:
        return []
    own = [(p, f) for p, f in counting if fit.condition in ("", f.condition)]
    if not own:
        return []
    by_noise, settings = estimator.by_noise, own[0][0].settings.diagnostics
    known = [(one, unbiased(p, one, by_noise)) for p, one in own]
    biases = [one.value - without for one, without in known if without is not None]
    if not biases:
        return []  # no loop is known, as the epochs say
    bias = np.mean(biases, axis=0)
    look = loop_bias(fit, fit.value - bias, by_noise, settings)
    if not look.failed:
        return []
    return [
        found(
            "loop_bias", settings, look.value, look.limit, effect=look.effect, variant=look.variant
        )
    ]


def _of_every(pool: Fit, fits: Sequence[Fit]) -> list[Finding]:
    """Return the cautions that all epochs of a pool carry and the pool does not carry yet.

    What all epochs share does not average out. Each is that of the epoch furthest beyond the limit.
    """
    own = [fit for fit in fits if fit.outcome.included and pool.condition in ("", fit.condition)]
    cautions = [{one.name: one for one in fit.findings if one.level != "note"} for fit in own]
    said = {one.name for one in pool.findings}
    common = []
    for name in cautions[0] if cautions else ():
        shown = [one[name] for one in cautions if name in one]
        if len(shown) == len(own) and name not in said:
            most = max(shown, key=lambda one: abs(one.value - one.limit))
            labels = tuple(fit.epoch for fit in own)
            common.append(replace(most, epochs=labels, condition=pool.condition))
    return common


def _with(fit: Fit, findings: Sequence[Finding]) -> Fit:
    return in_half_intervals(replace(fit, findings=(*fit.findings, *findings)))
