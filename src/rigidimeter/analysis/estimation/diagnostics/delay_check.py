"""Whether a delay between torque and motion that was found and not taken out moves J and B.

Torque that is stamped τ late makes of J s² + B s + K, to the first order in τ,

    (J − B τ) s² + (B − K τ) s + K

It is corrected unless a reflex, friction or a soft cuff explains the torque as well (`alignment`).
Where it is not, and the perturbation was not recorded, its cause is not known. Where the drive is
not known either, a delay as short as that of the acceleration at the ticks may be the drive's,
which is in the interval of J.
"""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.closedloop.between_samples import acceleration_late_s
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import closed_loop_obstacle
from rigidimeter.analysis.estimation.diagnostics.check_record import Case, Check, Look
from rigidimeter.analysis.estimation.prepared import PreparedEpoch, drive_followed
from rigidimeter.core.findings import Effect
from rigidimeter.model import DriveModel

SIGNIFICANT = 3.0
"""In standard errors."""


def delay_of_drive_s(prepared: PreparedEpoch) -> float:
    """Return which delay of the torque may be the drive's, where it was not followed; else 0.

    Inertia is most of the torque where a delay shows, so an acceleration that is late at the ticks
    looks like a late torque. Which drive it was is not known: that of the settings tells the size.
    """
    if drive_followed(prepared):
        return 0.0
    rig = prepared.settings.rig
    drive = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
    return abs(acceleration_late_s(drive, 1.0 / rig.tick_rate_hz))


def torque_delay(case: Case) -> Look | None:
    """Return how late the torque is, in ms, where that moves J or B by more than half an interval.

    None where nothing is known of it, where it was taken out, and where the perturbation is known.
    """
    delay, prepared = case.delay, case.prepared
    if delay is None or delay.corrected or prepared is None:
        return None
    late_s = abs(delay.delay_s)
    known = not closed_loop_obstacle(case.epoch)
    if known or not late_s > delay_of_drive_s(prepared) + SIGNIFICANT * delay.delay_s_se:
        return None
    _, B, K = case.parameters
    # Of a late torque J is B τ too low and B is K τ.
    bias = np.array([-abs(B), -abs(K), 0.0]) * delay.delay_s
    effect = Effect.of(bias, case.parameters, case.half_widths)
    share = float(np.max(np.abs(bias) / case.half_widths))
    most_ms, facts = 1e3 * late_s / share, {"late_ms": 1e3 * delay.delay_s}
    return Look(1e3 * late_s, most_ms, share > 1.0, facts, effect=effect)


DELAY_CHECKS = (Check("torque_delay", (), torque_delay),)
