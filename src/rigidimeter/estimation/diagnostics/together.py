"""What the epochs of a condition show together: the lack of fit, and the bias of their pool.

The lack of fit is a matter of the joint, not of an epoch, so each epoch of the condition carries
what was found. It is tested at the J, B and K that the perturbation gives, for every method: at
those of least squares the subject's own torque would show in the residual as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rigidimeter.estimation.closedloop.lack_of_fit import (
    Answer,
    Misfit,
    periodic,
    proportional,
    repeated,
    same_sequence,
)
from rigidimeter.estimation.closedloop.linear_problems import LEAST
from rigidimeter.estimation.closedloop.observation import (
    Observation,
    closed_loop_obstacle,
    observe,
    observe_periods,
)
from rigidimeter.estimation.closedloop.spectral_lines import Complex
from rigidimeter.estimation.diagnostics.diagnose import CHECKS, unbiased
from rigidimeter.estimation.diagnostics.movement_checks import loop_bias
from rigidimeter.estimation.method_record import Method
from rigidimeter.estimation.methods import method_named
from rigidimeter.estimation.prepared import PreparedEpoch
from rigidimeter.estimation.signals import Array
from rigidimeter.records import Finding, Fit
from rigidimeter.settings import DiagnosticsSettings

CHANCE = 1e-4
"""Probability, over all parts of all tests of a condition, below which it is not noise."""


class Observed(NamedTuple):
    """An epoch with the J, B and K that the perturbation gives, and what it causes at them."""

    observation: Observation
    values: Array
    caused: Complex

    @property
    def answer(self) -> Answer:
        """What the lack of fit is tested with."""
        lines = self.observation.lines
        residual = lines.torque_nm - lines.motion @ self.values
        return Answer(lines.grid, self.caused @ np.maximum(self.values, LEAST), residual)


def checked_together(
    prepared: Sequence[PreparedEpoch],
    fits: Sequence[Fit],
    pooled: Sequence[Fit],
    estimator: Method,
) -> tuple[list[Fit], list[Fit]]:
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
    conditions = dict.fromkeys(fit.condition for _, fit in counting)
    of_condition: dict[str, list[Finding]] = {}
    for condition in conditions:
        members = [(p, f) for p, f in counting if f.condition == condition]
        finding = lack_of_fit(members, estimator)
        of_condition[condition] = [finding] if finding is not None else []
    return (
        [_with(fit, of_condition[fit.condition]) if fit.outcome.included else fit for fit in fits],
        [
            _with(
                fit, [*of_condition.get(fit.condition, []), *_pooled_bias(fit, counting, estimator)]
            )
            for fit in pooled
        ],
    )


def lack_of_fit(members: Sequence[tuple[PreparedEpoch, Fit]], estimator: Method) -> Finding | None:
    """Return what follows the perturbation and is not J, B and K; None where nothing was found.

    Parameters
    ----------
    members : sequence of (PreparedEpoch, Fit)
        Epochs of one condition that count; those without a perturbation are passed over.
    estimator : Method
        That made the fits.
    """
    observed, tests = misfits(members, estimator)
    if not observed:
        return None
    settings = members[0][0].settings.diagnostics
    return _worst(tests, observed, settings)


def misfits(
    members: Sequence[tuple[PreparedEpoch, Fit]], estimator: Method
) -> tuple[list[Observed], list[Misfit]]:
    """Return the epochs in which the lack of fit can be seen, and what each test says of them.

    Parameters are those of `lack_of_fit`.
    """
    known = [(p, f) for p, f in members if not closed_loop_obstacle(p.epoch)]
    if not estimator.uses_perturbation and known:
        by_iv, _ = method_named("iv").fit([p for p, _ in known], None, lambda _: None, False)
        known = [(p, fit) for (p, _), fit in zip(known, by_iv, strict=True) if fit.outcome.included]
    if not known:
        return [], []
    values = np.array([fit.value for _, fit in known])
    common = np.maximum(np.median(values, axis=0), LEAST)
    observed = []
    for (epoch, _), own in zip(known, values, strict=True):
        try:
            observed.append(_member(epoch.once(observe), own, common))
        except ValueError:
            continue  # the fit of the epoch says why
    if not observed:
        return [], []
    return observed, _tested([member.answer for member in observed], known[0], common)


def _member(observation: Observation, values: Array, common: Array) -> Observed:
    assert observation.excitation is not None  # `observe` gives it
    J, B, K = common.tolist()
    return Observed(observation, values, observation.excitation.motion_lines((J, B, K)))


def _tested(
    answers: Sequence[Answer], first: tuple[PreparedEpoch, Fit], common: Array
) -> list[Misfit]:
    """Return what each test finds: those of sequences need two epochs or two periods."""
    found = proportional(answers)
    together = max(same_sequence(answers), key=len)
    if len(together) > 1:
        return found + repeated(together)
    prepared, fit = first
    try:
        periods = prepared.once(observe_periods)
    except ValueError:
        return found  # there are not two periods
    return found + periodic(_member(periods, fit.value, common).answer, periods.excited)


def _worst(
    found: Sequence[Misfit], observed: Sequence[Observed], settings: DiagnosticsSettings
) -> Finding | None:
    """Return the finding for the part with the largest misfit that is not noise; None without."""
    most = settings.lack_of_fit_most_percent
    sure = [part for part in found if part.p * len(found) < CHANCE and 100 * part.share > most]
    if not sure:
        return None
    worst = max(sure, key=lambda part: part.share)
    return Finding(
        "lack_of_fit",
        settings.levels.lack_of_fit,
        100 * worst.share,
        most,
        f"from {worst.low_hz:.3g} to {worst.high_hz:.3g} Hz {100 * worst.share:.2g} % of the "
        f"torque's response to the perturbation is not J, B and K (at most {most:g} %; by chance "
        f"p = {worst.p:.1g}){_in_half_the_band(observed)}: friction, a reflex, a soft cuff or a "
        "lag of a channel is taken for the joint",
        "lower the upper edge of the band (--band-hz) and see whether J and B change; look at the "
        "coupling; `rigidimeter model --compare` tries terms for it",
    )


def _in_half_the_band(observed: Sequence[Observed]) -> str:
    """Say how far J, B and K are different where only the lower half of the band is fitted."""
    found = []
    for share in (1.0, 0.5):
        gram, moment = np.zeros((3, 3)), np.zeros(3)
        for member in observed:
            lines = member.observation.lines
            part = slice(0, int(share * lines.torque_nm.size))
            power = np.abs(lines.torque_nm[part] - lines.motion[part] @ member.values) ** 2
            weighted = member.caused[part] / np.mean(power)
            gram += (weighted.conj().T @ lines.motion[part]).real
            moment += (weighted.conj().T @ lines.torque_nm[part]).real
        scale = np.sqrt(np.abs(np.diag(gram)))
        found.append(np.linalg.lstsq(gram / np.outer(scale, scale), moment / scale)[0] / scale)
    J, B, K = 100 * (found[1] / found[0] - 1)
    return f"; the lower half of the band gives J {J:+.2g} %, B {B:+.2g} %, K {K:+.2g} %"


def _pooled_bias(
    fit: Fit, counting: Sequence[tuple[PreparedEpoch, Fit]], estimator: Method
) -> list[Finding]:
    """Return the bias of a pooled fit by least squares, where it is more than its interval."""
    if estimator.uses_perturbation:
        return []
    own = [(p, f) for p, f in counting if fit.condition in ("", f.condition)]
    if not own:
        return []
    bias = np.mean([one.value - p.once(unbiased) for p, one in own], axis=0)
    settings = own[0][0].settings.diagnostics
    look = loop_bias(fit, fit.value - bias, settings)
    (check,) = (check for check in CHECKS if check.name == "loop_bias")
    return [check.finding(look, settings)] if look.failed else []


def _with(fit: Fit, findings: Sequence[Finding]) -> Fit:
    return replace(fit, findings=(*fit.findings, *findings)) if findings else fit
