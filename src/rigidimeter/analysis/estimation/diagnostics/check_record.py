"""What a check is: one `Check` record with its function, in the module of its kind."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np

from rigidimeter.analysis.estimation.found import UNKNOWN_WIDTH, found, half_widths
from rigidimeter.analysis.estimation.method_record import Method
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.core.findings import UNKNOWN_EFFECT, Effect, Fact, Finding
from rigidimeter.core.records import Delay, Epoch, Fit
from rigidimeter.core.settings import DiagnosticsSettings

T = TypeVar("T")

Harmless = tuple[str, Mapping[str, Fact]]
"""The variant of the words that says why, and the facts that it shows."""

HARMFUL: Harmless = ("", {})


HELD = 0.05
"""Of a parameter: a bias that the interval holds is known to the first order, so that the square of
this share of it is not."""


def too_biased(
    bias: Array, values: Array, half_widths: Array, most_percent: float, in_interval: bool
) -> bool:
    """Return whether the bias of J, B or K is more than so many % of half its interval.

    One that the interval holds must also be more than `HELD` of the parameter.
    """
    small = np.abs(bias) <= most_percent / 100.0 * half_widths
    if in_interval:
        small |= np.abs(bias) <= HELD * np.abs(values)
    return not np.all(small)


def push_harmless(case: Case, look: Look) -> Harmless:
    """Return why torque of the subject's own does not bias the estimate; `HARMFUL` if it does."""
    del look
    if case.uses_perturbation:
        return "instrument", {}
    if not case.loop_bias_is_small:
        return HARMFUL
    if case.bias_in_interval:
        # Torque that shows no joint is not the joint's.
        shown = bool(np.all(np.abs(case.parameters) > case.half_widths))
        return ("in_interval", {}) if shown else HARMFUL
    assert case.loop_bias is not None  # one that is small is known
    percent = 100.0 * np.abs(case.loop_bias) / case.half_widths
    return "small_bias", {"share": float(np.max(percent))}


def push_effect(case: Case) -> Effect:
    """Return what torque of the subject's own does to the estimate, as far as that is known."""
    if case.uses_perturbation:
        return Effect((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    bias = case.loop_bias
    return UNKNOWN_EFFECT if bias is None else Effect.of(bias, case.parameters, case.half_widths)


@dataclass(frozen=True)
class Case:
    """What checks look at.

    Parameters
    ----------
    epoch : Epoch
        As recorded.
    signals : Signals
        What was fitted.
    parameters : array, shape (3,)
        J in kg·m², B in N·m·s/rad, K in N·m/rad.
    settings : DiagnosticsSettings
    position_limit_rad : float, optional
        Where the position limit was, each way from angle 0.
    fit : Fit, optional
        The estimate with its intervals.
    method : Method, optional
        That made it.
    unbiased : array, shape (3,), optional
        For least squares: J, B and K without the bias that torque of the subject causes by the
        loop, NaN where it is too much to be told.
    bias_in_interval : bool
        Whether the intervals of the fit hold that bias.
    prepared : PreparedEpoch, optional
        The epoch with what was made of it; without it nothing is said of a joint that varies,
        of terms that are missing, nor of the controller.
    delay : Delay, optional
        Of the torque of its source.
    """

    epoch: Epoch
    signals: Signals
    parameters: Array
    settings: DiagnosticsSettings
    position_limit_rad: float | None = None
    fit: Fit | None = None
    method: Method | None = None
    unbiased: Array | None = None
    bias_in_interval: bool = False
    prepared: PreparedEpoch | None = None
    delay: Delay | None = None
    _made: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False)

    @property
    def uses_perturbation(self) -> bool:
        """Whether the perturbation is the instrument of the method used."""
        return self.method is not None and self.method.uses_perturbation

    @property
    def loop_bias(self) -> Array | None:
        """By how much J, B and K are off because torque of the subject comes back by the loop.

        Shape (3,), NaN where it is too much to be told; None where `unbiased` is.
        """
        return None if self.unbiased is None else np.asarray(self.parameters - self.unbiased)

    @property
    def half_widths(self) -> Array:
        """Half the 95 % intervals of J, B and K; `UNKNOWN_WIDTH` of them where there are none."""
        if self.fit is None:
            return np.abs(self.parameters) * UNKNOWN_WIDTH
        return half_widths(self.fit)

    @property
    def loop_bias_is_small(self) -> bool:
        """Whether J, B and K can be used as they are, whatever the loop does to least squares."""
        if self.loop_bias is None:
            return False
        most = self.settings.max_loop_bias_percent
        large = too_biased(
            self.loop_bias, self.parameters, self.half_widths, most, self.bias_in_interval
        )
        return not large

    def once(self, make: Callable[[Case], T]) -> T:
        """Return ``make(self)``, made when the first check asks for it."""
        if make not in self._made:
            self._made[make] = make(self)
        found: T = self._made[make]
        return found

    @cached_property
    def with_active(self) -> Fit | None:
        """The fit with the stretches that are left out for an active muscle; None if none is."""
        if self.prepared is None or self.method is None or self.prepared.with_active is None:
            return None
        whole = replace(self.prepared, epoch=self.prepared.with_active, with_active=None)
        (fit,), _ = self.method.fit([whole], None, lambda _: None, False)
        return fit if fit.n_samples else None

    @cached_property
    def voluntary_nm(self) -> Array:
        """The torque that J, B and K do not explain, as the subject's own: shape (n,), in N·m."""
        return reconstructed_torque_nm(self.signals, self.parameters)

    def has(self, name: str) -> bool:
        """Return whether a channel was recorded; a perturbation must also have changed."""
        channel = self.epoch.channels.get(name)
        if channel is None or name != "perturbation_nm":
            return channel is not None
        return len(channel) > 1 and float(np.ptp(channel.values)) > 0.0


class Look(NamedTuple):
    """What a check saw.

    `value` and `limit` are in the unit of the kind of finding; `failed` says whether the value is
    on the wrong side; one that is not a number is. `facts` are what else the words show, and
    `variant` which words they are. `excludes` says that the numbers mean nothing, although others
    of the kind may not.
    """

    value: float
    limit: float
    failed: bool
    facts: Mapping[str, Fact] = {}
    variant: str = ""
    effect: Effect = UNKNOWN_EFFECT
    p: float = math.nan
    excludes: bool = False


@dataclass(frozen=True)
class Check:
    """A check of an epoch and its fit.

    Parameters
    ----------
    name : str
        Of its kind of finding (`rigidimeter.core.findings.KINDS`).
    needs : tuple of str
        The channels without which there is nothing to look at.
    function : callable
        From a `Case` to a `Look`; None if there turns out to be nothing to look at.
    of_fit : bool
        Whether the function looks at J, B and K; where not, it is called once for each epoch and
        not again for each method.
    harmless : callable
        From a `Case` in which the check failed to the variant of the words that says why this
        cannot move J, B or K of the method used by more than their intervals, and the facts that
        it shows; `HARMFUL` where it can. What is harmless is a note, unless
        `[diagnostics.levels]` sets another level than the default.
    effect : callable
        From a `Case` in which the check failed to what that does to J, B and K, where the look
        does not say it.
    may_exclude : bool
        Whether a look may say `excludes`.
    """

    name: str
    needs: tuple[str, ...]
    function: Callable[[Case], Look | None]
    of_fit: bool = True
    harmless: Callable[[Case, Look], Harmless] = lambda case, look: HARMFUL
    effect: Callable[[Case], Effect] = lambda case: UNKNOWN_EFFECT
    may_exclude: bool = False

    def looks(self, case: Case) -> Look | None:
        """Return what the check sees, or None where it lacks what it needs."""
        return self.function(case) if all(case.has(name) for name in self.needs) else None

    def finding(self, look: Look, case: Case) -> Finding:
        """Return a failure as a finding."""
        variant, why = self.harmless(case, look)
        method = {} if case.method is None else {"method": case.method.name}
        return found(
            self.name,
            case.settings,
            look.value,
            look.limit,
            p=look.p,
            condition=case.epoch.condition,
            effect=self.effect(case) if look.effect == UNKNOWN_EFFECT else look.effect,
            facts={**look.facts, **why, **(method if variant == "instrument" else {})},
            variant=look.variant,
            harmless=variant,
            excludes=look.excludes,
        )


def at_most(value: float, most: float, **facts: Fact) -> Look:
    """Return a look that fails above a limit, or if the value is not a number."""
    return Look(value, most, not value <= most, facts)


def at_least(value: float, least: float, **facts: Fact) -> Look:
    """Return a look that fails below a limit, or if the value is not a number."""
    return Look(value, least, not value >= least, facts)


def reconstructed_torque_nm(signals: Signals, parameters: Array) -> Array:
    """Return the subject's own torque, M_sub of Eq. 5, in N·m, shape (n,), in the signals' band."""
    return np.asarray(signals.motion @ parameters - signals.torque_nm, dtype=np.float64)
