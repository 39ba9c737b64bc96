"""What a check is: one `Check` record with its function, in the module of its kind."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np

from rigidimeter.analysis.estimation.between_epochs import in_full
from rigidimeter.analysis.estimation.method_record import Method
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.core.records import Epoch, Finding, Fit
from rigidimeter.core.settings import DiagnosticLevels, DiagnosticsSettings, Level
from rigidimeter.model import Loop

T = TypeVar("T")

DEFAULT_LEVELS = DiagnosticLevels()

UNKNOWN_WIDTH = 0.1
"""The share of a parameter that stands for half its interval where a method gives none."""


def half_widths(fit: Fit) -> Array:
    """Return half the 95 % intervals of J, B and K; without intervals `UNKNOWN_WIDTH` of them."""
    half = 0.5 * (fit.high - fit.low)
    return np.where(np.isfinite(half), half, np.abs(fit.value) * UNKNOWN_WIDTH)


def push_harmless(case: Case, look: Look) -> str:
    """Return why torque of the subject's own does not bias the estimate; empty where it does."""
    del look
    if case.uses_perturbation and case.method is not None:
        return (
            f"{case.method.name} uses the motion that the perturbation causes alone, so torque "
            "that something but the robot adds does not bias J, B and K; it is in their intervals"
        )
    share = case.loop_bias_percent
    if share is not None and share <= case.settings.max_loop_bias_percent:
        return f"it biases J, B and K by {in_full(share)} % of half their intervals at most"
    return ""


def never(case: Case, look: Look) -> str:
    """Return that a failed check is not harmless."""
    del case, look
    return ""


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
    loop : Loop, optional
        In which the joint was moved, as the settings and the recording say.
    unbiased : array, shape (3,), optional
        For least squares: J, B and K without the bias that torque of the subject causes by the
        loop, NaN where it is too much to be told.
    prepared : PreparedEpoch, optional
        The epoch with what was made of it; without it nothing is said of a joint that varies,
        of terms that are missing, nor of the controller.
    """

    epoch: Epoch
    signals: Signals
    parameters: Array
    settings: DiagnosticsSettings
    position_limit_rad: float | None = None
    fit: Fit | None = None
    method: Method | None = None
    loop: Loop | None = None
    unbiased: Array | None = None
    prepared: PreparedEpoch | None = None
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
    def loop_bias_percent(self) -> float | None:
        """`loop_bias` in % of `half_widths`, the largest of the three."""
        bias = self.loop_bias
        return None if bias is None else 100.0 * float(np.max(np.abs(bias) / self.half_widths))

    def once(self, make: Callable[[Case], T]) -> T:
        """Return ``make(self)``, made when the first check asks for it."""
        if make not in self._made:
            self._made[make] = make(self)
        found: T = self._made[make]
        return found

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

    `value` and `threshold` are in the unit that `fact` states; `failed` says whether the value is
    on the wrong side; one that is not a number is. `meaning` and `remedy` replace those of the
    check where they are not empty.
    """

    value: float
    threshold: float
    failed: bool
    fact: str
    meaning: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class Check:
    """A check of an epoch and its fit.

    Parameters
    ----------
    name : str
        As `[diagnostics.levels]` names it; a check that is not named there casts doubt.
    needs : tuple of str
        The channels without which there is nothing to look at.
    function : callable
        From a `Case` to a `Look`; None if there turns out to be nothing to look at.
    meaning : str
        What it means if the check fails.
    remedy : str
        What to do about it.
    of_fit : bool
        Whether the function looks at J, B and K; where not, it is called once for each epoch and
        not again for each method.
    harmless : callable
        From a `Case` in which the check failed to the reason why this cannot move J, B or K of the
        method used by more than their intervals; an empty text where it can. What is harmless is a
        note with the reason in place of the meaning, unless `[diagnostics.levels]` sets another
        level than the default.
    """

    name: str
    needs: tuple[str, ...]
    function: Callable[[Case], Look | None]
    meaning: str
    remedy: str
    of_fit: bool = True
    harmless: Callable[[Case, Look], str] = never

    def level(self, settings: DiagnosticsSettings) -> Level:
        """Return what a failure does."""
        level: Level = getattr(settings.levels, self.name, "doubt")
        return level

    def looks(self, case: Case) -> Look | None:
        """Return what the check sees, or None where it lacks what it needs."""
        return self.function(case) if all(case.has(name) for name in self.needs) else None

    def finding(self, look: Look, settings: DiagnosticsSettings, harmless: str = "") -> Finding:
        """Return what was seen as a finding; a check that passed is a note without a remedy.

        Parameters
        ----------
        look : Look
        settings : DiagnosticsSettings
        harmless : str
            Why a failure does not move J, B or K; empty where it does.
        """
        if not look.failed:
            return Finding(self.name, "note", look.value, look.threshold, look.fact, "")
        level = self.level(settings)
        if harmless and level == getattr(DEFAULT_LEVELS, self.name, "doubt"):
            level = "note"
        return Finding(
            self.name,
            level,
            look.value,
            look.threshold,
            f"{look.fact}: {harmless or look.meaning or self.meaning}",
            look.remedy or self.remedy,
        )


def at_most(value: float, most: float, fact: str, meaning: str = "") -> Look:
    """Return a look that fails above a threshold, or if the value is not a number."""
    return Look(value, most, not value <= most, fact, meaning)


def at_least(value: float, least: float, fact: str, meaning: str = "") -> Look:
    """Return a look that fails below a threshold, or if the value is not a number."""
    return Look(value, least, not value >= least, fact, meaning)


def reconstructed_torque_nm(signals: Signals, parameters: Array) -> Array:
    """Return the subject's own torque, M_sub of Eq. 5, in N·m, shape (n,), in the signals' band."""
    J, B, K = parameters
    return np.asarray(
        J * signals.acceleration_rad_s2
        + B * signals.velocity_rad_s
        + K * signals.angle_rad
        - signals.torque_nm,
        dtype=np.float64,
    )
