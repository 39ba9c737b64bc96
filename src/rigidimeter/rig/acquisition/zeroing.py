"""The zero of the torque sensor, and why a run must not begin with it."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence

from rigidimeter.core.settings import Settings, ZeroingSettings
from rigidimeter.core.units import deg_from_rad
from rigidimeter.rig.devices.base import Reading

MIN_ZEROING_SAMPLES = 10
"""The standard deviation of fewer samples is not the sensor's noise."""


def bias_and_noise(
    readings: Sequence[Reading], limits: ZeroingSettings
) -> tuple[float, float, str]:
    """Return mean and SD of the torque at rest in N·m, and why the run must not begin, if so."""
    torques_nm, stamp_s = [], -math.inf
    for reading in readings:
        if reading.torque_time_s > stamp_s:  # one that repeats the sample before counts once
            stamp_s = reading.torque_time_s
            torques_nm.append(reading.torque_nm)
    n = len(torques_nm)
    if n < MIN_ZEROING_SAMPLES:
        why = (
            f"only {n} torque samples came in {limits.duration_s:g} s, fewer than "
            f"{MIN_ZEROING_SAMPLES}; check the sensor's connection and its rate, or raise "
            "zeroing.duration_s"
        )
        return math.nan, math.nan, why
    bias_nm, noise_sd_nm = statistics.fmean(torques_nm), statistics.stdev(torques_nm)
    why = ""
    if abs(bias_nm) > limits.bias_limit_nm:
        why = (
            f"at rest the torque sensor reads {bias_nm:.3g} N·m, more than "
            f"zeroing.bias_limit_nm = {limits.bias_limit_nm:g} N·m: it was zeroed under load, "
            "or its calibration is another; unload it and start again"
        )
    elif noise_sd_nm > limits.noise_limit_nm:
        why = (
            f"at rest the torque varies by {noise_sd_nm:.3g} N·m (SD), more than "
            f"zeroing.noise_limit_nm = {limits.noise_limit_nm:g} N·m: the subject moves, or "
            "the sensor is noisy; wait until the subject is relaxed, or check the cable"
        )
    return bias_nm, noise_sd_nm, why


def motion_objection(readings: Sequence[Reading], settings: Settings) -> str:
    """Return why a torque is none at rest, if so: a joint in motion needs torque by itself."""
    limit_deg = settings.zeroing.motion_limit_deg
    range_deg = angle_range_deg(readings)
    if range_deg <= limit_deg + settings.rig.motion.angle_resolution_deg:
        return ""
    return (
        f"the joint moved by {range_deg:.3g} deg while the torque sensor was zeroed, more than "
        f"zeroing.motion_limit_deg = {limit_deg:g} deg: the drive does not hold it still; check "
        "its tuning and whether somebody pushes, then `rigidimeter check`"
    )


def angle_range_deg(readings: Sequence[Reading]) -> float:
    """Return how far the joint moved meanwhile, from the smallest to the largest angle."""
    angles_rad = [reading.angle_rad for reading in readings]
    return deg_from_rad(max(angles_rad) - min(angles_rad))
