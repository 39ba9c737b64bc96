"""The finding that J, B or K hangs on what the drive did between the samples."""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.between_epochs import in_full
from rigidimeter.core.records import Epoch, Finding
from rigidimeter.core.settings import DiagnosticsSettings

REMEDY = (
    "sample the torque faster, or filter it before it is sampled and set "
    "estimation.torque_lowpass_hz to the corner; give the drive a lower bandwidth; or hold J at a "
    "value from a better recording"
)


def doubt_of(
    epoch: Epoch, name: str, percent: float, drive_known: bool, settings: DiagnosticsSettings
) -> tuple[Finding, ...]:
    """Return the finding where the parameter of that name may be so many percent elsewhere."""
    level, most = settings.levels.between_samples, settings.max_between_samples_percent
    if not drive_known and {"velocity_command_rad_s", "velocity_rad_s"} <= set(epoch.channels):
        text = (
            "no drive explains the velocity by the command, so how the joint moved between the "
            "samples is not known, and J may be far too low"
        )
        remedy = f"record the command at every tick at which it is sent; {REMEDY}"
        return (Finding("between_samples", level, np.nan, most, text, remedy),)
    if percent <= most:
        return ()
    shown = in_full(percent, limit=most)
    text = (
        f"drives that explain the velocity equally well give {name} up to {shown} % "
        f"away (at most {most:g} %): the samples do not show how the joint moved between them"
    )
    if not drive_known:
        text = (
            f"at the samples of the torque the drive of the settings makes {name} {shown} % "
            f"wrong (at most {most:g} %), and without velocity and command that is not corrected"
        )
    return (Finding("between_samples", level, percent, most, text, REMEDY),)
