"""Why an epoch cannot be estimated or does not count, and what to do about it."""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.signals import motion_channels
from rigidimeter.analysis.estimation.stretches import too_little
from rigidimeter.core.records import Epoch, Outcome
from rigidimeter.core.settings import USABLE_FRACTION_OF_RATE, EstimationSettings

LEAST_BAND_RATIO = 4.0
"""A band narrower than two octaves cannot distinguish three parameters."""

LARGEST_VALUE = 1e9
"""No joint has a torque, an angle or a velocity beyond this, in SI units."""

LARGEST_CONDITION_NUMBER = 1000.0
"""Beyond this the motion excites less than three parameters; a PRBS in the closed loop has 1.3."""


def before_fit(epoch: Epoch, settings: EstimationSettings) -> str:
    """Return why the epoch cannot be fitted, or an empty text."""
    torque = epoch.channels.get("torque_nm")
    motion = motion_channels(epoch)
    if torque is None:
        return "torque_nm was not recorded"
    if not motion:
        return "neither velocity_rad_s nor angle_rad was recorded"
    ends: dict[str, tuple[float, float]] = {}
    sent = (epoch.channels.get(name) for name in ("velocity_command_rad_s", "perturbation_nm"))
    for channel in (torque, *motion, *(one for one in sent if one is not None and len(one) > 1)):
        if len(channel) < 2:
            return f"{channel.name} holds {len(channel)} sample(s)"
        ends[channel.name] = float(np.min(channel.values)), float(np.max(channel.values))
        if not np.all(np.isfinite(ends[channel.name])):
            bad = int(np.argmin(np.isfinite(channel.values)))
            return (
                f"{channel.name} is {channel.values[bad]} at {channel.time_s[bad]:.4g} s; "
                "samples must be finite numbers"
            )
    slowest = min((torque, *motion), key=lambda channel: channel.rate_hz)
    if USABLE_FRACTION_OF_RATE * slowest.rate_hz < LEAST_BAND_RATIO * settings.band_low_hz:
        return (
            f"{slowest.name} was sampled at {slowest.rate_hz:.3g} Hz, too slowly for a band from "
            f"{settings.band_low_hz:g} Hz up; check the unit of the time stamps (seconds)"
        )
    start = max(float(channel.time_s[0]) for channel in (torque, *motion))
    stop = min(float(channel.time_s[-1]) for channel in (torque, *motion))
    # The last sample of an epoch begins one interval before its end.
    if stop - start + 1 / slowest.rate_hz < settings.min_epoch_s * (1 - 1e-3):
        spans_s = [float(channel.time_s[-1] - channel.time_s[0]) for channel in (torque, *motion)]
        short = min(spans_s) - (stop - start) < 0.1 and max(spans_s) < settings.min_epoch_s
        length = "this part is {:.3g} s long" if short else "torque and motion overlap for {:.3g} s"
        return (
            f"{length.format(max(stop - start, 0.0))}; at least {settings.min_epoch_s:g} s are "
            "needed (estimation.min_epoch_s)"
        )
    if stop - start < 2 * settings.trim_s + 1:
        return (
            f"it lasts {stop - start:.3g} s, which leaves less than 1 s after trimming "
            f"{settings.trim_s:g} s at each end (estimation.trim_s)"
        )
    if reason := too_little(epoch, settings):
        return reason
    for channel in (torque, *motion):
        least, most = ends[channel.name]
        largest = max(-least, most)
        if largest > LARGEST_VALUE:
            return f"{channel.name} reaches {largest:.3g} {channel.unit}; check its unit"
        # A sensor that is connected shows its noise; one that repeats a number is not measuring.
        if most - least <= 1e-12 * largest:
            return (
                f"{channel.name} is constant ({channel.values[0]:g} {channel.unit}); "
                "check that the sensor was connected and its column is the right one"
            )
    return ""


def after_fit(
    epoch: Epoch, r_squared: float, condition_number: float, *, least_r_squared: float = 0.0
) -> Outcome:
    """Return whether a fitted epoch counts, and why not.

    Excluded are epochs that were not closed with success (among them those that touched a position
    limit), those with R² below zero (Sec. 2.4.4), and those whose motion cannot tell the
    parameters apart. `least_r_squared` is lower for methods that do not minimise the residual:
    there a subject who pushes may turn R² negative and the estimate still be right.
    """
    if not epoch.closed.included:
        return Outcome("excluded", epoch.closed.reason)
    if r_squared < least_r_squared:
        least = "zero" if least_r_squared == 0 else f"{least_r_squared:g}"
        return Outcome("excluded", f"R² is {r_squared:.3g}, below {least}")
    if condition_number > LARGEST_CONDITION_NUMBER:
        return Outcome(
            "excluded",
            f"the motion cannot distinguish J, B and K (condition number {condition_number:.3g}, "
            f"limit {LARGEST_CONDITION_NUMBER:g}); a perturbation with more frequencies is needed",
        )
    return Outcome()


def unusable(epoch: Epoch, reason: str) -> Outcome:
    """Return the outcome of an epoch without numbers.

    One that was not closed with success is excluded for that reason; any other has failed.
    """
    if not epoch.closed.included:
        return Outcome("excluded", f"{epoch.closed.reason}; {reason}")
    return Outcome("failed", reason)
