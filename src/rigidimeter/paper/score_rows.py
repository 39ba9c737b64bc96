"""The scores of Sec. 2.3 under an imposed sinusoid: Eq. 1, Eq. 2 and their closed forms.

For θ = A sin ωt, imposed without the controller (Sec. 2.6), the torque of Eq. 3 is a sinusoid of
amplitude A √((K − Jω²)² + (Bω)²), so that

    impulse per cycle = 4 A √((K − Jω²)² + (Bω)²) / ω,      work per cycle = π B ω A²

The work does not depend on K. Where torque and angle are late against each other, or the loop is
summed from one side, it seems to:

    left sum:          −(K − J ω²)/2 Σ(Δθ)² is added
    torque late by τ:  π A² (B ω cos ωτ − (K − J ω²) sin ωτ)
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from rigidimeter.analysis.estimation import Cycles, loop_area_j, score_epoch, scoring_cycles
from rigidimeter.analysis.figures import GREY, draw_loops, drawn
from rigidimeter.analysis.report import Figure
from rigidimeter.core.records import Channel, Epoch, Motion, Score
from rigidimeter.core.settings import Settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.core.words import number
from rigidimeter.model import Array, JointDynamics
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import Claim, bounded, within_percent
from rigidimeter.paper.context import Context
from rigidimeter.planning import sinusoid

SCORE_PERCENT = 0.5
"""How far a score may be from its closed form; the band-pass remembers the start of the motion."""


def imposed_epoch(joint: JointDynamics, settings: Settings, uneven: float = 0.0) -> Epoch:
    """Return an epoch of the sinusoid as it would be recorded, without noise.

    The drive imposes θ(t) and Eq. 3 gives the torque. The rates of the sensors must divide that of
    the ticks. The stiffness is K (1 + `uneven`) at positive angles and K (1 − `uneven`) at negative
    ones.
    """
    rig, sine, tick_hz = settings.rig, settings.sinusoid, settings.rig.tick_rate_hz
    angle, velocity = sinusoid(sine, tick_hz)
    time_s = np.arange(angle.size) / tick_hz
    torque = joint.torque_nm(angle, velocity, CubicSpline(time_s, velocity).derivative()(time_s))
    torque = torque + uneven * joint.stiffness_nm_rad * np.abs(angle)
    channels = {}
    for name, values, rate_hz in (
        ("torque_nm", torque, rig.torque.rate_hz),
        ("angle_rad", angle, rig.motion.rate_hz),
        ("velocity_rad_s", velocity, rig.motion.rate_hz),
    ):
        sampled = slice(None, None, round(tick_hz / rate_hz))
        channels[name] = Channel(name, time_s[sampled], values[sampled])
    return Epoch(
        source="virtual sinusoid",
        label="1",
        channels=channels,
        task="sinusoid",
        motion=Motion(sine.frequency_hz, 0.0, sine.motion_s),
        virtual=True,
    )


def factored(joint: JointDynamics, damping: float = 1.0, stiffness: float = 1.0) -> JointDynamics:
    """Return the joint with damping and stiffness times a factor."""
    return replace(
        joint,
        damping_nm_s_rad=damping * joint.damping_nm_s_rad,
        stiffness_nm_rad=stiffness * joint.stiffness_nm_rad,
    )


def scored(joint: JointDynamics, settings: Settings) -> Score:
    """Return the product's scores of a joint under the sinusoid, without noise."""
    return score_epoch(imposed_epoch(joint, settings), settings.scores, settings.estimation)


def _parts(joint: JointDynamics, settings: Settings) -> tuple[float, float, float, float]:
    """Return A in rad, ω in rad/s, K − Jω² and Bω."""
    omega = 2.0 * math.pi * settings.sinusoid.frequency_hz
    elastic = joint.stiffness_nm_rad - joint.inertia_kg_m2 * omega**2
    amplitude = rad_from_deg(settings.sinusoid.amplitude_deg)
    return amplitude, omega, elastic, joint.damping_nm_s_rad * omega


def work_closed_form_j(joint: JointDynamics, settings: Settings, delay_s: float = 0.0) -> float:
    """Return the work per cycle, π A² (B ω cos ωτ − (K − J ω²) sin ωτ), in J."""
    amplitude, omega, elastic, viscous = _parts(joint, settings)
    phase = omega * delay_s
    return math.pi * amplitude**2 * (viscous * math.cos(phase) - elastic * math.sin(phase))


def work_change_percent(
    settings: Settings,
    rate_hz: float,
    rule: str = "trapezoid",
    delay_s: float = 0.0,
    *,
    damping: float = 1.0,
    stiffness: float = 1.0,
) -> float:
    """Return by how much the work changes when damping and stiffness change by a factor, in %.

    From bare samples of Eq. 3 with the joint of Fig. 6; `rule` is ``left`` or ``trapezoid``.
    """

    def work(joint: JointDynamics) -> float:
        torque, angle = _pure_cycles(joint, settings, rate_hz, delay_s)
        if rule == "left":
            return float(np.sum(torque[:-1] * np.diff(angle)))
        return loop_area_j(torque, angle)

    return 100.0 * (work(factored(printed.FIG_6, damping, stiffness)) / work(printed.FIG_6) - 1.0)


def _pure_cycles(
    joint: JointDynamics, settings: Settings, rate_hz: float, delay_s: float = 0.0
) -> tuple[Array, Array]:
    """Return torque and angle of the cycles that are scored, unfiltered, end point included."""
    amplitude, omega, _, _ = _parts(joint, settings)
    count = round(settings.scores.cycles * rate_hz / settings.sinusoid.frequency_hz)
    time_s = np.arange(count + 1) / rate_hz
    late = omega * (time_s - delay_s)
    torque = joint.torque_nm(
        amplitude * np.sin(late),
        amplitude * omega * np.cos(late),
        -amplitude * omega**2 * np.sin(late),
    )
    return torque, amplitude * np.sin(omega * time_s)


def equation_1(context: Context) -> Claim:
    """Compare the angular impulse with its closed form."""
    ours = scored(printed.FIG_6, context.settings).impulse_nm_s
    amplitude, omega, elastic, viscous = _parts(printed.FIG_6, context.settings)
    wanted = 4.0 * amplitude * math.hypot(elastic, viscous) / omega
    return Claim(
        ours=f"{number(ours, 5)} N·m·s a cycle for the joint of Fig. 6; the integral is "
        f"{number(wanted, 5)}",
        checks=(within_percent("Impulse per cycle", "N·m·s", wanted, ours, SCORE_PERCENT),),
    )


def equation_2(context: Context) -> Claim:
    """Compare Eq. 2 with and without the displacement increment."""
    settings = context.settings
    area = scored(printed.FIG_6, settings).work_j
    wanted = work_closed_form_j(printed.FIG_6, settings)
    torque, _ = _pure_cycles(printed.FIG_6, settings, settings.rig.tick_rate_hz)
    # Without the rounding that is left of a sum of nothing.
    as_printed = round(float(np.sum(torque[:-1])) / settings.scores.cycles, 9) + 0.0
    return Claim(
        ours=f"as printed {abs(as_printed):.4f} N·m; with the increment, Σ M Δθ / n, "
        f"{number(area, 5)} J (πBωA² = {number(wanted, 5)} J)",
        checks=(
            within_percent("Σ M / n as printed", "", wanted, as_printed, SCORE_PERCENT),
            within_percent("Σ M Δθ / n", "J", wanted, area, SCORE_PERCENT),
        ),
    )


_UNEVEN = 0.3
"""Of the arm in `asymmetry`: stiffer by 30 % one way and softer by 30 % the other."""


def asymmetry(context: Context) -> Claim:
    """Compare the torque at the two ends of the motion, of a linear and of an uneven arm.

    With K (1 ± ε) on either side the torque at the ends is ±(K (1 ± ε) − Jω²) A, and a spring of
    any shape gives back what it takes: the work stays π B ω A².
    """
    settings = context.settings
    uneven_epoch = imposed_epoch(printed.FIG_6, settings, _UNEVEN)
    cycles = scoring_cycles(uneven_epoch, settings.scores)
    linear, uneven = (
        _asymmetry_percent(one)
        for one in (scoring_cycles(imposed_epoch(printed.FIG_6, settings), settings.scores), cycles)
    )
    work = score_epoch(uneven_epoch, settings.scores, settings.estimation).work_j
    change = 100.0 * (work / work_closed_form_j(printed.FIG_6, settings) - 1.0)
    return Claim(
        ours=f"torque at the two ends, difference over mean: {number(linear, 2)} % for Eq. 3, "
        f"{number(uneven, 3)} % for an arm {100 * _UNEVEN:g} % stiffer one way and softer the "
        f"other, whose work is off by {number(change, 2)} %",
        checks=(
            bounded("Asymmetry of a linear arm", "%", linear, high=SCORE_PERCENT),
            bounded("Asymmetry of an uneven arm", "%", uneven, low=10.0),
        ),
        figures=(
            Figure(
                "fig-7-uneven",
                f"Fig. 7 for a computed arm that is {100 * _UNEVEN:g} % stiffer at positive angles "
                "and as much softer at negative ones.",
                "Torque against angle of an arm whose stiffness differs by direction: eight loops.",
                partial(
                    drawn, (3.4, 3.0), draw_loops, [("", cycles, GREY)], None, "uneven stiffness"
                ),
                "small",
            ),
        ),
    )


def _asymmetry_percent(cycles: Cycles) -> float:
    """Return how far the torques at largest and smallest angle differ in size, in % of their mean.

    The band-pass takes the mean torque away, so half of the difference is left of a stiffness that
    changes at the middle; a linear arm has none.
    """
    high, low = (
        abs(float(cycles.torque_nm[index(cycles.angle_rad)])) for index in (np.argmax, np.argmin)
    )
    return 100.0 * abs(high - low) / (0.5 * (high + low))
