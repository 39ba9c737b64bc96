"""The scores of Sec. 2.3 under an imposed sinusoid: Eq. 1, Eq. 2 and Fig. 6.

For θ = A sin ωt and Eq. 3 the torque is a sinusoid of amplitude A √((K − Jω²)² + (Bω)²), so that

    impulse per cycle = 4 A √((K − Jω²)² + (Bω)²) / ω,      work per cycle = π B ω A²

The work does not depend on K. Where torque and angle are late against each other, or the loop is
summed from one side, it seems to:

    left sum:          −(K − J ω²)/2 Σ(Δθ)² is added
    torque late by τ:  π A² (B ω cos ωτ − (K − J ω²) sin ωτ)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.estimation import score_epoch
from rigidimeter.estimation.scores import loop_area_j
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import AGREES, DIFFERS, Row, within_percent
from rigidimeter.paper.context import Workshop
from rigidimeter.paper.imposed import imposed_epoch, pure_cycles
from rigidimeter.records import Score
from rigidimeter.reporting.numbers import number
from rigidimeter.settings import Settings
from rigidimeter.units import rad_from_deg

__all__ = [
    "ROWS",
    "impulse_closed_form_nm_s",
    "scaled",
    "scored",
    "work_change_percent",
    "work_closed_form_j",
]

SCORE_PERCENT = 0.5
"""How far a score may be from its closed form; the band-pass remembers the start of the motion."""


def scaled(joint: JointDynamics, damping: float = 1.0, stiffness: float = 1.0) -> JointDynamics:
    """Return the joint with damping and stiffness times a factor."""
    return replace(
        joint,
        damping_nm_s_rad=damping * joint.damping_nm_s_rad,
        stiffness_nm_rad=stiffness * joint.stiffness_nm_rad,
    )


def work_closed_form_j(joint: JointDynamics, settings: Settings, delay_s: float = 0.0) -> float:
    """Return the work per cycle, π A² (B ω cos ωτ − (K − J ω²) sin ωτ), in J."""
    omega = 2.0 * math.pi * settings.sinusoid.frequency_hz
    amplitude = rad_from_deg(settings.sinusoid.amplitude_deg)
    elastic = joint.stiffness_nm_rad - joint.inertia_kg_m2 * omega**2
    viscous = joint.damping_nm_s_rad * omega
    phase = omega * delay_s
    return math.pi * amplitude**2 * (viscous * math.cos(phase) - elastic * math.sin(phase))


def impulse_closed_form_nm_s(joint: JointDynamics, settings: Settings) -> float:
    """Return the angular impulse per cycle, in N·m·s."""
    omega = 2.0 * math.pi * settings.sinusoid.frequency_hz
    amplitude = rad_from_deg(settings.sinusoid.amplitude_deg)
    elastic = joint.stiffness_nm_rad - joint.inertia_kg_m2 * omega**2
    return 4.0 * amplitude * math.hypot(elastic, joint.damping_nm_s_rad * omega) / omega


def _work_j(
    joint: JointDynamics, settings: Settings, rate_hz: float, rule: str, delay_s: float
) -> float:
    """Return the loop area per cycle by one rule, ``left`` or ``trapezoid``, in J."""
    cycles = pure_cycles(joint, settings, rate_hz, delay_s)
    if rule == "left":
        total = float(np.sum(cycles.torque_nm[:-1] * np.diff(cycles.angle_rad)))
    else:
        total = loop_area_j(cycles.torque_nm, cycles.angle_rad)
    return total / settings.scores.cycles


def work_change_percent(
    settings: Settings,
    rate_hz: float,
    rule: str = "trapezoid",
    delay_s: float = 0.0,
    *,
    damping: float = 1.0,
    stiffness: float = 1.0,
    joint: JointDynamics = printed.FIG_6,
) -> float:
    """Return by how much the work changes when damping and stiffness change by a factor, in %."""
    before = _work_j(joint, settings, rate_hz, rule, delay_s)
    after = _work_j(scaled(joint, damping, stiffness), settings, rate_hz, rule, delay_s)
    return 100.0 * (after / before - 1.0)


def scored(joint: JointDynamics, settings: Settings) -> Score:
    """Return the product's scores of a joint under the sinusoid, without noise."""
    return score_epoch(imposed_epoch(joint, settings), settings.scores, settings.estimation)


def equation_1(workshop: Workshop) -> Row:
    """Make the row: the angular impulse against its closed form."""
    settings = workshop.settings
    ours = scored(printed.FIG_6, settings).impulse_nm_s
    wanted = impulse_closed_form_nm_s(printed.FIG_6, settings)
    return Row(
        id="eq-1",
        source="Eq. 1",
        paper="A = Σ|M_meas|Δt / n, n = 8 cycles",
        ours=f"{number(ours, 5)} N·m·s a cycle for the joint of Fig. 6; the integral is "
        f"{number(wanted, 5)}",
        reading="Of the band-passed torque over whole cycles.",
        checks=(within_percent("Impulse per cycle", "N·m·s", wanted, ours, SCORE_PERCENT),),
        because={AGREES: "As printed it is the integral 4A√((K − Jω²)² + (Bω)²)/ω of a sinusoid."},
    )


def equation_2(workshop: Workshop) -> Row:
    """Make the row: Eq. 2 with and without the displacement increment."""
    settings = workshop.settings
    area = scored(printed.FIG_6, settings).work_j
    wanted = work_closed_form_j(printed.FIG_6, settings)
    cycles = pure_cycles(printed.FIG_6, settings, settings.rig.tick_rate_hz)
    as_printed = float(np.sum(cycles.torque_nm[:-1])) / settings.scores.cycles
    as_printed = round(as_printed, 9) + 0.0  # what is left of nothing after rounding
    return Row(
        id="eq-2",
        source="Eq. 2",
        paper='W = Σ M_meas / n; "the area within the hysteresis loop"',
        ours=f"as printed {abs(as_printed):.4f} N·m; with the increment, Σ M Δθ / n, "
        f"{number(area, 5)} J (πBωA² = {number(wanted, 5)} J)",
        reading="With the displacement increment, as the text says: the area of the loop.",
        checks=(
            within_percent("Σ M / n as printed", "", wanted, as_printed, SCORE_PERCENT),
            within_percent("Σ M Δθ / n", "J", wanted, area, SCORE_PERCENT),
        ),
        because={
            DIFFERS: "The printed sum lacks Δθ: over whole cycles the torque sums to nothing, and "
            "its unit is no work. With Δθ it is the area of the text."
        },
    )


ROWS: Mapping[str, Callable[[Workshop], Row]] = {
    "eq-1": equation_1,
    "eq-2": equation_2,
}
