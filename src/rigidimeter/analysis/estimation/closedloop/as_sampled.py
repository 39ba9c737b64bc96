"""How far least squares hangs on what the drive did between the samples.

Least squares at the torque's samples (`bandlimited`) follows the drive that was identified, and J
may be elsewhere by as much as other drives have the torque see another share of the acceleration.
Where no drive was identified, or where the samples are taken as they are, J lacks what the torque
did not see. With commands held from tick to tick that is not the same share of the acceleration at
every frequency, nor quite in phase with it, so B and K are moved as well.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import fft

from rigidimeter.analysis.estimation.closedloop.between_finding import NAME, between_finding
from rigidimeter.analysis.estimation.closedloop.between_samples import (
    INEXACT,
    TorqueFilter,
    acceleration_by_settings,
    acceleration_late_s,
    accelerations_seen,
    behind,
    filtered,
    phases_s,
    step_kept_s,
    torque_filter_of,
)
from rigidimeter.analysis.estimation.found import found
from rigidimeter.analysis.estimation.least_squares_bias import BEYOND_BAND
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.core.findings import Finding
from rigidimeter.core.settings import RigSettings
from rigidimeter.model import DriveModel


class InertiaUncertainty(NamedTuple):
    """How far J, B and K may be elsewhere, either way, for each unit of J; what is said of it."""

    away: Array
    findings: tuple[Finding, ...] = ()


NONE = InertiaUncertainty(np.zeros(3))


def inertia_uncertainty(prepared: PreparedEpoch, signals: Signals) -> InertiaUncertainty:
    """Return the uncertainty where the drive was followed as far as it is known."""
    drive, epoch = prepared.source.drive, prepared.epoch
    command = epoch.channels.get("velocity_command_rad_s")
    torque_filter = torque_filter_of(prepared.settings.estimation)
    known = drive is not None and command is not None
    away = np.zeros(3)
    if drive is None or command is None:
        rig = prepared.settings.rig
        away = np.abs(moved_by_settings(rig, torque_filter, signals))
        share = abs(1.0 / acceleration_by_settings(rig, torque_filter) - 1.0)
    else:
        interval_s, stamps_s = 1.0 / command.mean_rate_hz, epoch.channels["torque_nm"].time_s
        drives, times_s = (drive.model, *drive.rivals), phases_s(command, stamps_s)
        ours, *others = accelerations_seen(drives, torque_filter, interval_s, times_s).tolist()
        others.append(ours + INEXACT * (1.0 - ours))
        kept_s = step_kept_s(command, stamps_s)
        if kept_s is not None:
            others += accelerations_seen(
                drives[:1], torque_filter, interval_s, np.array([kept_s])
            ).tolist()
        share = max(abs(ours / other - 1.0) for other in others)
    away[0] = share
    values = np.abs(signals.solution.values)
    percent = 100.0 * away * values[0] / np.maximum(values, 1e-300)
    settings = prepared.settings.diagnostics
    return InertiaUncertainty(away, between_finding(epoch, percent, 0, known, settings))


def moved_by_settings(
    rig: RigSettings, torque_filter: TorqueFilter | None, signals: Signals
) -> Array:
    """Return how far J, B and K of least squares are moved, for each unit of J, shape (3,).

    The torque holds J (A − jω V) of the command beyond J, B and K of the samples, A and V being the
    acceleration and the velocity at the ticks by the drive and the ticks of the settings. Least
    squares takes it for J, B and K:

        (Σ Re Φ^H Φ)⁻¹ Σ Re Φ^H (A/V − jω) v

    with v and Φ the lines of the velocity, and of acceleration, velocity and angle.
    """
    n, interval_s = signals.time_s.size, 1.0 / rig.tick_rate_hz
    # A taper, or the slow part of the angle leaks into all lines.
    spectra = fft.rfft(signals.motion * np.hanning(n)[:, None], axis=0)
    highest_hz = min(BEYOND_BAND * signals.band_hz[1], 0.49 * min(signals.rate_hz, 1 / interval_s))
    motion = spectra[1 : int(highest_hz * n / signals.rate_hz) + 1]
    omega = 2 * np.pi * signals.rate_hz / n * np.arange(1, motion.shape[0] + 1)
    drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    z = np.exp(1j * omega * interval_s)
    velocity = drive.transfer(z, interval_s)[1]
    seen = behind(drive, torque_filter).transfer(z, interval_s)[0]
    beyond = seen / filtered(torque_filter, omega)[:, 0] / velocity - 1j * omega
    scale = np.linalg.norm(motion, axis=0)
    gram = (motion.conj().T @ motion).real / np.outer(scale, scale)
    moment = (motion.conj().T @ (beyond * motion[:, 1])).real / scale
    return np.asarray(np.linalg.solve(gram, moment) / scale)


def delay_of_drive_s(prepared: PreparedEpoch) -> float:
    """Return which delay of the torque may be the drive's, where it was not followed; else 0.

    Inertia is most of the torque where a delay shows, so an acceleration that is late at the ticks
    looks like a late torque. Which drive it was is not known: that of the settings tells the size.
    """
    if prepared.source.drive is not None and "velocity_command_rad_s" in prepared.epoch.channels:
        return 0.0
    rig = prepared.settings.rig
    drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    return abs(acceleration_late_s(drive, 1.0 / rig.tick_rate_hz))


def as_they_are(prepared: PreparedEpoch, signals: Signals) -> InertiaUncertainty:
    """Return the finding if the drive shows that J comes out wrong from the samples as they are."""
    del signals
    drive, epoch = prepared.source.drive, prepared.epoch
    command = epoch.channels.get("velocity_command_rad_s")
    if drive is None or command is None:
        return NONE
    settings = prepared.settings.diagnostics
    times_s = phases_s(command, epoch.channels["torque_nm"].time_s)
    (seen,) = accelerations_seen([drive.model], None, 1.0 / command.mean_rate_hz, times_s)
    percent, most = 100.0 * abs(1.0 - seen), settings.max_between_samples_percent
    if not percent > most:
        return NONE
    finding = found(
        NAME,
        settings,
        percent,
        most,
        condition=epoch.condition,
        facts={"seen": 100.0 * float(seen), "side": "small" if seen < 1 else "large"},
        variant="as_sampled",
    )
    return InertiaUncertainty(NONE.away, (finding,))
