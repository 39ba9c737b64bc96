"""How far J of least squares hangs on what the drive did between the samples.

Least squares at the torque's samples (`bandlimited`) follows the drive that was identified, and J
may be elsewhere by as much as other drives have the torque see another share of the acceleration.
Where no drive was identified, or where the samples are taken as they are, J lacks what the torque
did not see.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rigidimeter.estimation.closedloop.between_finding import doubt_of
from rigidimeter.estimation.closedloop.between_samples import (
    INEXACT,
    acceleration_by_settings,
    accelerations_seen,
    phases_s,
    step_kept_s,
    torque_filter_of,
)
from rigidimeter.estimation.prepared import PreparedEpoch
from rigidimeter.records import Finding

REMEDY = (
    "use --method iv with the perturbation recorded, which corrects it; or sample faster, or give "
    "the drive a lower bandwidth"
)


class InertiaDoubt(NamedTuple):
    """The share of J that it may be elsewhere, either way, and what is said of it."""

    share: float
    findings: tuple[Finding, ...] = ()


def inertia_doubt(prepared: PreparedEpoch) -> InertiaDoubt:
    """Return the doubt of J where the drive was followed as far as it is known."""
    found, epoch = prepared.source.drive, prepared.epoch
    command = epoch.channels.get("velocity_command_rad_s")
    torque_filter = torque_filter_of(prepared.settings.estimation)
    known = found is not None and command is not None
    if found is None or command is None:
        share = abs(1.0 / acceleration_by_settings(prepared.settings.rig, torque_filter) - 1.0)
    else:
        interval_s, stamps_s = 1.0 / command.mean_rate_hz, epoch.channels["torque_nm"].time_s
        drives, times_s = (found.model, *found.rivals), phases_s(command, stamps_s)
        ours, *others = accelerations_seen(drives, torque_filter, interval_s, times_s).tolist()
        others.append(ours + INEXACT * (1.0 - ours))
        kept_s = step_kept_s(command, stamps_s)
        if kept_s is not None:
            others += accelerations_seen(
                drives[:1], torque_filter, interval_s, np.array([kept_s])
            ).tolist()
        share = max(abs(ours / other - 1.0) for other in others)
    return InertiaDoubt(
        share, doubt_of(epoch, "J", 100.0 * share, known, prepared.settings.diagnostics)
    )


def as_they_are(prepared: PreparedEpoch) -> InertiaDoubt:
    """Return the finding if the drive shows that J comes out wrong from the samples as they are."""
    found, epoch = prepared.source.drive, prepared.epoch
    command = epoch.channels.get("velocity_command_rad_s")
    if found is None or command is None:
        return InertiaDoubt(0.0)
    settings = prepared.settings.diagnostics
    times_s = phases_s(command, epoch.channels["torque_nm"].time_s)
    (seen,) = accelerations_seen([found.model], None, 1.0 / command.mean_rate_hz, times_s)
    percent, most = 100.0 * abs(1.0 - seen), settings.between_samples_most_percent
    if not percent > most:
        return InertiaDoubt(0.0)
    text = (
        f"the torque was sampled where the acceleration is {100 * seen:.3g} % of its mean between "
        f"the samples (at most {most:g} % away), and J is taken to be as much too "
        f"{'small' if seen < 1 else 'large'}"
    )
    level = settings.levels.between_samples
    return InertiaDoubt(0.0, (Finding("between_samples", level, percent, most, text, REMEDY),))
