"""Zero and noise of the torque sensor without power, judged as a run judges them when it begins."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition import angle_range_deg, bias_and_noise, moved
from rigidimeter.rig.commissioning.checks import number
from rigidimeter.rig.commissioning.first_steps import SETTLE_S
from rigidimeter.rig.commissioning.trial import Setup, drop_old_samples, listen
from rigidimeter.rig.devices.base import DeviceError, Reading


@dataclass(frozen=True)
class ZeroFound:
    """What the sensors read at rest.

    Attributes
    ----------
    bias_nm, noise_sd_nm : float
        Mean and SD of the torque; NaN if too few samples came.
    range_deg : float
        How far the joint moved.
    objection : str
        Why a run would refuse to begin with it; empty if it would not.
    """

    bias_nm: float
    noise_sd_nm: float
    range_deg: float
    objection: str

    def words(self, settings: Settings) -> str:
        """Return each value beside its limit, to a hundredth of that."""
        limits = settings.zeroing
        rows = (
            ("bias", self.bias_nm, limits.bias_limit_nm, "N·m"),
            ("noise (SD)", self.noise_sd_nm, limits.noise_limit_nm, "N·m"),
            ("motion", self.range_deg, limits.motion_limit_deg, "deg"),
        )
        return ", ".join(
            f"{name} {_rounded(value, limit, unit)} (at most {number(limit, unit)})"
            for name, value, limit, unit in rows
        )


def _rounded(value: float, limit: float, unit: str) -> str:
    """Return a value to a hundredth of its limit.

    >>> _rounded(0.000112, 1.0, "N·m"), _rounded(0.00478, 0.1, "N·m"), _rounded(-0.1, 250.0, "N·m")
    ('0.00 N·m', '0.005 N·m', '0 N·m')
    """
    if not math.isfinite(value):
        return number(None, unit)
    places = max(0, 2 - math.floor(math.log10(limit)))
    return f"{round(value, places) + 0.0:.{places}f} {unit}"  # no -0.00


def zero_check(setup: Setup) -> ZeroFound:
    """Listen for `zeroing.duration_s`; the rig is connected and closed, and never has power.

    A device that does not answer is an objection.
    """
    rig, settings = setup.rig, setup.settings
    readings: list[Reading] = []

    def keep(reading: Reading) -> bool:
        readings.append(reading)
        return False

    try:
        rig.connect()
        rig.configure()
        setup.operator.say(
            f"At rest, without power: {settings.zeroing.duration_s:g} s. Nobody touches the joint; "
            "a subject is relaxed."
        )
        drop_old_samples(setup)
        listen(setup, SETTLE_S)
        listen(setup, settings.zeroing.duration_s, until=keep)
    except DeviceError as error:
        return ZeroFound(math.nan, math.nan, math.nan, str(error))
    finally:
        rig.close()
    bias_nm, noise_sd_nm, why = bias_and_noise(readings, settings.zeroing)
    why = why or moved(readings, settings)
    return ZeroFound(bias_nm, noise_sd_nm, angle_range_deg(readings), why)
