"""Whether a delay between torque and motion that was found and not taken out moves J and B.

Torque that is stamped τ late makes of J s² + B s + K, to the first order in τ,

    (J − B τ) s² + (B − K τ) s + K

It is corrected unless a reflex, friction or a soft cuff explains the torque as well (`alignment`).
Where it is not, and the perturbation was not recorded, its cause is not known. Where the drive is
not known either, a delay as short as that of the acceleration at the ticks may be the drive's,
which is in the interval of J.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimation.closedloop.between_samples import acceleration_late_s
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import closed_loop_obstacle
from rigidimeter.analysis.estimation.found import found, half_widths
from rigidimeter.analysis.estimation.prepared import PreparedEpoch, drive_followed
from rigidimeter.core.findings import Effect, Finding
from rigidimeter.core.records import Delay, Fit
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


def with_torque_delay(prepared: PreparedEpoch, fit: Fit, delays: Sequence[Delay]) -> Fit:
    """Return the fit with the finding, if a delay moves J or B by more than half their intervals.

    Parameters
    ----------
    prepared : PreparedEpoch
    fit : Fit
        Of the epoch. Where the perturbation is known, nothing is added.
    delays : sequence of Delay
        Of all sources.
    """
    found = _torque_delay(prepared, fit, delays) if closed_loop_obstacle(prepared.epoch) else ()
    return replace(fit, findings=(*fit.findings, *found)) if found else fit


def _torque_delay(
    prepared: PreparedEpoch, fit: Fit, delays: Sequence[Delay]
) -> tuple[Finding, ...]:
    delay = next((delay for delay in delays if delay.source == fit.source), None)
    if delay is None or delay.corrected or not fit.n_samples:
        return ()
    late_s = abs(delay.delay_s)
    if not late_s > delay_of_drive_s(prepared) + SIGNIFICANT * delay.delay_s_se:
        return ()
    _, B, K = fit.value
    # Of a late torque J is B τ too low and B is K τ.
    bias = np.array([-abs(B), -abs(K), 0.0]) * delay.delay_s
    half = half_widths(fit)
    share = float(np.max(np.abs(bias) / half))
    if share <= 1.0:
        return ()
    late_ms, most_ms = 1e3 * delay.delay_s, 1e3 * late_s / share
    return (
        found(
            "torque_delay",
            prepared.settings.diagnostics,
            abs(late_ms),
            most_ms,
            condition=fit.condition,
            effect=Effect.of(bias, fit.value, half),
            facts={"late_ms": late_ms},
        ),
    )
