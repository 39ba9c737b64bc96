"""J, B and K while the epoch runs, with their intervals; hidden until they mean something.

A value means something once

- the causal filters have forgotten how they began. The slowest is the high-pass, a Butterworth
  filter of second order with the poles ω (−1 ± i) / √2, ω = 2π f: what it keeps of its beginning
  falls as exp(−ω t / √2), to 5 % after t = 3 √2 / ω, 4.5 s at 0.15 Hz;
- half of its 95 % interval is below half of the value: zero, and so the other sign, is then more
  than twice as far away as the interval reaches;
- it no longer moves: half of what is remembered ago it differed by less than half of what it is
  now. The standard error allows for noise that is white in the band, so it may be small while the
  value still comes down from far away.

An imposed sinusoid has one frequency, at which K − J ω² is all that can be known of J and K, so
nothing is shown of it.

When an epoch has ended, two numbers tell of the torque sensor, both in proportion to its gain.

- J is of the arm and of what the rig has beyond the sensor. Unlike B and K it does not change from
  epoch to epoch. It is not less than the rig's alone, which the daily check knows, and lies among
  the arms that the margins hold for.
- The torque's change from one tick to the next is noise, and J times the change of the
  acceleration, which is the same in each epoch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist, median

from rigidimeter.core.settings import OnlineSettings
from rigidimeter.core.words import with_error
from rigidimeter.rig.acquisition.processes import LiveEstimate

MAX_PART = 0.5
"""Half an interval, and a shift, above this part of the value say that it is not known yet."""

KNOWN_PART = 0.1
"""J is known where its standard error is below this part of it."""

ALIKE, LIGHTER, STEPS = 1.6, 0.8, 3.0
"""J is within so many times that of other epochs, and at least so much of the rig's alone; the
torque changes from tick to tick by less than so many times as much as in others."""

NORMAL_95 = NormalDist().inv_cdf(0.975)

_VALUES = (
    ("J", "inertia_kg_m2", "kg·m²"),
    ("B", "damping_nm_s_rad", "N·m·s/rad"),
    ("K", "stiffness_nm_rad", "N·m/rad"),
)


@dataclass(frozen=True)
class LiveValue:
    """One parameter as the operator may read it.

    Attributes
    ----------
    symbol, unit : str
    value, half_width : float
        The estimate and half of its 95 % interval; NaN where nothing is known.
    settled : bool
        Whether to show them.
    why_not : str
        Why they are hidden, in words; empty where they are not.
    """

    symbol: str
    unit: str
    value: float
    half_width: float
    settled: bool
    why_not: str

    @property
    def text(self) -> str:
        """The value with its interval and unit, or why there is none."""
        if not self.settled:
            return f"{self.symbol} {self.why_not}"
        return f"{self.symbol} {with_error(self.value, self.half_width)} {self.unit}"


def settling_s(settings: OnlineSettings) -> float:
    """Return after how long the filters have forgotten their beginning, to 5 %."""
    return 3.0 * math.sqrt(2.0) / (2.0 * math.pi * settings.band_low_hz)


def live_values(
    history: Sequence[LiveEstimate], task: str, settings: OnlineSettings, *, running: bool = True
) -> tuple[LiveValue, ...]:
    """Return J, B and K of the last estimate.

    Parameters
    ----------
    history : sequence of LiveEstimate
        Oldest first; those of other epochs are passed over.
    task : str
        Of the epoch that was estimated.
    settings : OnlineSettings
    running : bool
        Whether that epoch still runs.
    """
    now = history[-1] if history else LiveEstimate()
    elapsed_s = now.time_s - now.since_s
    common = ""
    if now.epoch < 0:
        common = "no epoch yet"
    elif task != "prbs":
        common = "not from a sinusoid"
    elif elapsed_s < settling_s(settings) and not running:
        common = "not known: the epoch was too short"
    elif elapsed_s < settling_s(settings):
        common = f"in {math.ceil(settling_s(settings) - elapsed_s)} s"
    # As much was remembered when half of it had been seen.
    middle_s = now.time_s - min(elapsed_s, now.memory_s) / 2.0
    same = [one for one in history if (one.epoch, one.since_s) == (now.epoch, now.since_s)]
    before = next((one for one in reversed(same) if one.time_s <= middle_s), None)
    return tuple(_value(symbol, name, unit, now, before, common) for symbol, name, unit in _VALUES)


def _value(
    symbol: str, name: str, unit: str, now: LiveEstimate, before: LiveEstimate | None, why: str
) -> LiveValue:
    value, half_width = getattr(now, name), NORMAL_95 * getattr(now, f"{name}_se")
    shift = abs(value - getattr(before, name)) if before is not None else math.inf
    if not why:
        if not half_width < MAX_PART * abs(value):
            percent = 100.0 * half_width / abs(value) if value else math.inf
            why = f"not known yet (±{percent:.0f} %)" if percent < 1000 else "not known yet"
        elif not shift < MAX_PART * abs(value):
            why = "still changes"
    return LiveValue(symbol, unit, value, half_width, not why, why)


def caution(
    now: LiveEstimate,
    before: Sequence[LiveEstimate],
    arms_kg_m2: tuple[float, float],
    alone_kg_m2: float = 0.0,
) -> str:
    """Return what of the torque in an epoch that has ended is not as it must be; empty if nothing.

    Parameters
    ----------
    now : LiveEstimate
        The last of the epoch, in which a torque perturbed.
    before : sequence of LiveEstimate
        The last of each such epoch before it.
    arms_kg_m2 : tuple of float
        Least and largest J for which the margins hold.
    alone_kg_m2 : float
        J of what the rig has beyond the sensor, 0 if not known.
    """
    check = "check the torque sensor and its cable, and type `rigidimeter check`"
    usual_nm = median([one.step_nm for one in before if one.step_nm > 0.0] or [math.inf])
    if now.step_nm > STEPS * usual_nm:
        times = f"{now.step_nm / usual_nm:.1f} times as much from tick to tick as in those before"
        return f"the torque changed {times}: noise, another gain, or a tremor; {check}"
    if not _known(now):
        return ""
    inertia, others = now.inertia_kg_m2, [one.inertia_kg_m2 for one in before if _known(one)]
    usual = median(others) if others else math.nan
    lightest, heaviest = arms_kg_m2
    for low, high, what in (
        (LIGHTER * alone_kg_m2, math.inf, f"less than the rig's alone, {alone_kg_m2:.3g}"),
        (usual / ALIKE, usual * ALIKE, f"{inertia / usual:.2g} times that of the epochs before"),
        (
            lightest,
            heaviest,
            f"not within {lightest:.3g} to {heaviest:.3g}, for which the margins hold",
        ),
    ):
        if inertia < low or inertia > high:
            found = f"J {inertia:.3g} kg·m² is {what}"
            return f"{found}: another gain of the torque sensor, or another arm; {check}"
    return ""


def _known(one: LiveEstimate) -> bool:
    return one.inertia_kg_m2_se < KNOWN_PART * one.inertia_kg_m2
