"""Whether a delay between torque and motion that was found and not taken out moves J and B.

Torque that is stamped τ late makes of J s² + B s + K, to the first order in τ,

    (J − B τ) s² + (B − K τ) s + K

It is corrected unless a reflex, friction or a soft cuff explains the torque as well (`alignment`).
Where it is not, and the perturbation was not recorded, its cause is not known. Where the drive is
not known either, as much as half a tick of it may be the drive's, which is in the intervals
(`clock_error`).
"""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.alignment import matters
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import closed_loop_obstacle
from rigidimeter.analysis.estimation.diagnostics.check_record import Case, Check, Look
from rigidimeter.core.findings import Effect


def torque_delay(case: Case) -> Look | None:
    """Return how late the torque is, in ms, where that moves J or B by more than half an interval.

    None where nothing is known of it, where it was taken out, and where the perturbation is known.
    """
    delay = case.delay
    if delay is None or delay.corrected or not matters(delay.delay_s, delay.delay_s_se):
        return None
    if not closed_loop_obstacle(case.epoch):
        return None
    _, B, K = case.parameters
    # Of a late torque J is B τ too low and B is K τ.
    bias = np.array([-abs(B), -abs(K), 0.0]) * delay.delay_s
    effect = Effect.of(bias, case.parameters, case.half_widths)
    share, late_s = float(np.max(np.abs(bias) / case.half_widths)), abs(delay.delay_s)
    most_ms, facts = 1e3 * late_s / share, {"late_ms": 1e3 * delay.delay_s}
    return Look(1e3 * late_s, most_ms, share > 1.0, facts, effect=effect)


DELAY_CHECKS = (Check("torque_delay", (), torque_delay),)
