"""How far J may be off because it is not known what the drive did between the samples.

A loop sends a command at each tick and the drive holds it. Torque that is sampled at the ticks sees
the acceleration there, which is this share of its mean (`acceleration_seen`):

    first order, bandwidth λ      λT / (e^(λT) − 1), and the torque seems half a tick late
    second order, bandwidth ω     1 − (ωT)²/12, and it hardly seems late

J comes out low by as much. Torque and motion alone do not show λ or ω, but where the torque is not
late its acceleration does not jump at the ticks, and a drive of first order is ruled out, unless a
command was recorded that no drive explains. The range of J is that over the drives which are left,
of all bandwidths up to that of the settings.
"""

from __future__ import annotations

import math

import numpy as np

from rigidimeter.analysis.estimation.closedloop.between_samples import acceleration_seen
from rigidimeter.analysis.estimation.diagnostics.check_record import Case, Check, Look
from rigidimeter.analysis.estimation.diagnostics.missing_term import friction_of_drive
from rigidimeter.core.findings import Effect, Fact
from rigidimeter.model import DriveModel

LATE = 0.1
"""A drive of first order is ruled out where the torque is late by less than this share of a tick.
On rigs of 200 to 1000 ticks/s it was .34 to .50 late with velocity PI drives, with drives of second
order at most .06 where these take less than 2 % off J."""


def unknown_drive(case: Case) -> Look | None:
    """Return by how much J may be too low, in %, where the loop was recorded and not its drive."""
    prepared, command = case.prepared, case.epoch.channels.get("velocity_command_rad_s")
    perturbation = case.epoch.channels.get("perturbation_nm") if case.uses_perturbation else None
    ticks = perturbation if command is None else command
    if prepared is None or ticks is None or not case.parameters[0] > 0.0:
        return None
    if prepared.source.drive is not None:
        return None
    interval_s, rig = 1.0 / ticks.mean_rate_hz, prepared.settings.rig
    late = math.nan if case.delay is None else case.delay.delay_s / interval_s
    if command is None and late < LATE:
        drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    else:
        fastest = 2 * math.pi * rig.drive_bandwidth_hz
        drive = DriveModel((complex(-fastest),), (complex(fastest),))
    seen = acceleration_seen(drive, interval_s, np.zeros(1))
    low = float(case.parameters[0])
    value, most = 100.0 * (1.0 / seen - 1.0), case.settings.max_between_samples_percent
    facts: dict[str, Fact] = {"symbol": "J", "low_j": low, "high_j": low / seen}
    facts["bandwidth_hz"] = rig.drive_bandwidth_hz
    effect = Effect((-100.0 * (1.0 - seen), math.nan, math.nan))
    return Look(value, most, value > most, facts, "unknown_drive", effect)


def between(case: Case) -> Look | None:
    """Return `unknown_drive`, or what friction of a drive leaves where no loop was recorded."""
    return unknown_drive(case) or friction_of_drive(case)


DRIVE_CHECKS = (Check("between_samples", (), between),)
