"""Whether a delay between torque and motion that was found and not taken out moves J, B or K.

Torque that is stamped τ late makes of J s² + B s + K, to the first order in τ,

    −J τ s³ + (J − B τ) s² + (B − K τ) s + K

of which least squares makes J, B and K as its weights have it: moved to its place, the torque gains
(e^(iωτ) − 1) Y, and p̂ gains C Σ Re(Uᴴ (e^(iωτ) − 1) Y).

It is corrected unless a reflex, friction or a soft cuff explains the torque as well (`alignment`).
Where it is not, and the perturbation was not recorded, its cause is not known. Where the drive is
not known either, as much as half a tick of it may be the drive's, which is in the intervals
(`clock_error`).
"""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.alignment import matters
from rigidimeter.analysis.estimation.closedloop.linear_problems import direct
from rigidimeter.analysis.estimation.closedloop.normal_equations import solution, sums
from rigidimeter.analysis.estimation.closedloop.observe import observe_motion
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import closed_loop_obstacle
from rigidimeter.analysis.estimation.closedloop.refine import shared_powers
from rigidimeter.analysis.estimation.diagnostics.check_record import Case, Check, Look
from rigidimeter.core.findings import Effect


def torque_delay(case: Case) -> Look | None:
    """Return how late the torque is, in ms, and how late it may be for the intervals to hold it.

    None where nothing is known of it, where it was taken out, and where the perturbation is known.
    """
    delay = case.delay
    if delay is None or delay.corrected or not matters(delay.delay_s, delay.delay_s_se):
        return None
    if case.prepared is None or not closed_loop_obstacle(case.epoch):
        return None
    observation = case.prepared.once(observe_motion)
    problems = direct([observation], case.parameters)
    turn = np.exp(1j * observation.grid.omega_rad_s * delay.delay_s) - 1.0
    added = [one._replace(target=turn * one.target) for one in problems]
    bias = -solution(*sums(added, shared_powers(problems, case.parameters))[:2])
    effect = Effect.of(bias, case.parameters, case.half_widths)
    share, late_s = float(np.max(np.abs(bias) / case.half_widths)), abs(delay.delay_s)
    most_ms, facts = 1e3 * late_s / share, {"late_ms": 1e3 * delay.delay_s}
    return Look(1e3 * late_s, most_ms, share > 1.0, facts, effect=effect)


DELAY_CHECKS = (Check("torque_delay", (), torque_delay),)
