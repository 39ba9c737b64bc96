"""What a check is: one `Check` record with its function, in the module of its kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigidimeter.estimation.signals import Array, Signals
from rigidimeter.records import Epoch, Finding
from rigidimeter.settings import DiagnosticsSettings


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
    limited : array, shape (m,), optional
        The recorded column of what the guard changed.
    position_limit_rad : float, optional
        Where the position limit was, each way from angle 0.
    """

    epoch: Epoch
    signals: Signals
    parameters: Array
    settings: DiagnosticsSettings
    limited: ArrayLike | None = None
    position_limit_rad: float | None = None

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
    """

    name: str
    needs: tuple[str, ...]
    function: Callable[[Case], Look | None]
    meaning: str
    remedy: str
    of_fit: bool = True

    def looks(self, case: Case) -> Look | None:
        """Return what the check sees, or None where it lacks what it needs."""
        return self.function(case) if all(case.has(name) for name in self.needs) else None

    def finding(self, look: Look, settings: DiagnosticsSettings) -> Finding:
        """Return what was seen as a finding; a check that passed is a note without a remedy."""
        if not look.failed:
            return Finding(self.name, "note", look.value, look.threshold, look.fact, "")
        return Finding(
            self.name,
            getattr(settings.levels, self.name, "doubt"),
            look.value,
            look.threshold,
            f"{look.fact}: {look.meaning or self.meaning}",
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
