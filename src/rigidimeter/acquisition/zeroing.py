"""Zero the torque sensor while the joint stands still, and refuse where it does not look at rest.

bias = mean of the torque, noise = its standard deviation, both in N·m
"""

from __future__ import annotations

import math
import statistics

from rigidimeter.devices.base import Reading
from rigidimeter.settings import ZeroingSettings

__all__ = ["FEWEST", "Zeroing"]

FEWEST = 10
"""Fewer samples tell nothing about noise."""


class Zeroing:
    """Hears readings, then says what they amount to.

    Parameters
    ----------
    limits : ZeroingSettings
    """

    def __init__(self, limits: ZeroingSettings) -> None:
        self._limits = limits
        self._torques_nm: list[float] = []
        self._stamp_s = -math.inf

    def hear(self, reading: Reading) -> None:
        """Take a reading; one that repeats the sample before counts once."""
        if reading.torque_time_s > self._stamp_s:
            self._stamp_s = reading.torque_time_s
            self._torques_nm.append(reading.torque_nm)

    def result(self) -> tuple[float, float, str]:
        """Return bias and noise in N·m, and why the run must not begin (empty if it may)."""
        limits, n = self._limits, len(self._torques_nm)
        if n < FEWEST:
            return math.nan, math.nan, f"only {n} torque samples came in {limits.duration_s:g} s"
        bias_nm = statistics.fmean(self._torques_nm)
        noise_sd_nm = statistics.stdev(self._torques_nm)
        why = ""
        if abs(bias_nm) > limits.bias_limit_nm:
            why = (
                f"at rest the torque sensor reads {bias_nm:.3g} N·m, more than "
                f"zeroing.bias_limit_nm = {limits.bias_limit_nm:g} N·m: it was zeroed under load, "
                "or its calibration is another"
            )
        elif noise_sd_nm > limits.noise_limit_nm:
            why = (
                f"at rest the torque varies by {noise_sd_nm:.3g} N·m (SD), more than "
                f"zeroing.noise_limit_nm = {limits.noise_limit_nm:g} N·m: the subject moves, or "
                "the sensor is noisy"
            )
        return bias_nm, noise_sd_nm, why
