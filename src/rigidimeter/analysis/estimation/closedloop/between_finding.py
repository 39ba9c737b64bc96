"""The finding that J, B or K depends on what the drive did between the samples."""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.found import found
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import Effect, Finding
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import DiagnosticsSettings

NAME = "between_samples"


def between_finding(
    epoch: Epoch, percent: Array, about: int, drive_known: bool, settings: DiagnosticsSettings
) -> tuple[Finding, ...]:
    """Return the finding where J, B or K may be too many percent elsewhere.

    Parameters
    ----------
    epoch : Epoch
    percent : array, shape (3,)
        How far J, B and K may be elsewhere, either way.
    about : int
        Which of them decides.
    drive_known : bool
    settings : DiagnosticsSettings
    """
    most, condition = settings.max_between_samples_percent, epoch.condition
    if not drive_known and {"velocity_command_rad_s", "velocity_rad_s"} <= set(epoch.channels):
        return (found(NAME, settings, np.nan, most, condition=condition, variant="no_drive"),)
    value = float(percent[about])
    if value <= most:
        return ()
    J, B, K = percent.tolist()
    return (
        found(
            NAME,
            settings,
            value,
            most,
            condition=condition,
            effect=Effect((J, B, K)),
            facts={"symbol": "JBK"[about]},
            variant="" if drive_known else "of_settings",
        ),
    )
