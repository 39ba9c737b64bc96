"""The arm (Eq. 3), and the admittance controller: the unit of its two numbers, Eq. 4 and 5.

Sec. 2.4.2 prints J_c and B_c per degree, App. A the same two numbers per radian: 57.3 times apart.
Only the motion can tell. In the ideal loop

    (J_c + J_p) θ'' + (B_c + B_p) θ' + K_p θ = M_PRBS

each reading has its position SD, and the paper reports about 4 deg.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from rigidimeter.core.settings import ControllerSettings, PrbsSettings, Settings
from rigidimeter.core.units import deg_from_rad, per_rad_from_per_deg
from rigidimeter.core.words import number
from rigidimeter.model import (
    JointDynamics,
    Loop,
    arm_response,
    closed_loop_motion,
    loop_margins,
)
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import Claim, bounded, within_percent
from rigidimeter.paper.context import Context
from rigidimeter.planning import ideal_response, prbs_nm

CLOCKS_HZ = (20.0, 22.6)
"""Clocks of a 7-bit sequence that reach 10 Hz: by the band of Sec. 2.4.3, and by half power."""

READINGS: Mapping[str, ControllerSettings] = {
    "per degree": ControllerSettings(
        inertia_kg_m2=per_rad_from_per_deg(printed.CONTROLLER_INERTIA),
        damping_nm_s_rad=per_rad_from_per_deg(printed.CONTROLLER_DAMPING),
    ),
    "per radian": ControllerSettings(
        inertia_kg_m2=printed.CONTROLLER_INERTIA, damping_nm_s_rad=printed.CONTROLLER_DAMPING
    ),
}
"""The two ways to read J_c and B_c, in SI units."""

ABOUT_PERCENT = 50.0
"""What "approximately 4 deg" is taken to allow."""

LOOP_PERCENT = 10.0
"""How far the equation of the ideal loop may be from the loop with filter and drive."""

_FAST_HZ = 400.0
"""Of torque filter and drive, in the loop that comes close to the ideal one."""

_SINE_HZ, _CYCLES, _RATE_HZ = 2.0, 20, 1000.0
"""The torque that moves the arm of Eq. 3."""


def equation_3(context: Context) -> Claim:
    """Compare the arm under a sinusoidal torque with the compliance of Eq. 3."""
    joint = printed.SEC_34
    count = round(_CYCLES * _RATE_HZ / _SINE_HZ)
    phase = 2.0 * math.pi * _SINE_HZ * np.arange(count) / _RATE_HZ
    angles, _ = arm_response(joint, np.sin(phase), 1.0 / _RATE_HZ)
    last = slice(count // 2, None)  # the beginning has died out by then
    found = 2.0 * float(abs(np.mean(angles[last] * np.exp(-1j * phase[last]))))
    wanted = float(abs(joint.compliance_rad_nm(_SINE_HZ)))
    return Claim(
        ours=f"|θ/M| at {_SINE_HZ:g} Hz {number(found)} rad/N·m stepped through time, "
        f"{number(wanted)} rad/N·m from the transfer function",
        checks=(within_percent("|θ/M| at 2 Hz", "rad/N·m", wanted, found, 0.5),),
    )


def position_sd_deg(reading: str, clock_hz: float) -> float:
    """Return the SD of the angle in the ideal loop with the joint of Sec. 3.4, in deg."""
    rate_hz = Settings().rig.tick_rate_hz
    perturbation = prbs_nm(PrbsSettings(clock_hz=clock_hz), rate_hz)
    angle, _ = ideal_response(perturbation, READINGS[reading], printed.SEC_34, rate_hz)
    return deg_from_rad(float(np.std(angle)))


def units(reading: str, context: Context) -> Claim:
    """Compare J_c and B_c, read per degree or per radian, with the motion of the paper."""
    sds = {each: [position_sd_deg(each, clock) for clock in CLOCKS_HZ] for each in READINGS}
    nearest = min(
        READINGS,
        key=lambda each: sum(abs(math.log(sd / printed.POSITION_SD_DEG)) for sd in sds[each]),
    )
    controller = READINGS[reading]
    settings = Settings(controller=controller)
    margins = loop_margins(settings, printed.SEC_34)
    return Claim(
        ours=f"J_c = {number(controller.inertia_kg_m2)} kg·m²/rad, "
        f"B_c = {number(controller.damping_nm_s_rad)} N·m·s/rad: position SD "
        f"{' and '.join(number(sd, 3) for sd in sds[reading])} deg (the ideal loop with a 7-bit "
        f"PRBS at 20 and 22.6 Hz); the loop with the 20 Hz filter and a "
        f"{settings.rig.drive_bandwidth_hz:g} Hz drive is "
        f"{'stable' if margins.stable else 'unstable'} "
        f"(gain margin {number(margins.gain_margin_db, 3)} dB)",
        reading=f"Read {nearest}: of the two readings its position SD is nearest to the paper's.",
        checks=tuple(
            within_percent(
                f"Position SD read {reading}, clock {clock_hz:g} Hz",
                "deg",
                printed.POSITION_SD_DEG,
                sd,
                ABOUT_PERCENT,
            )
            for clock_hz, sd in zip(CLOCKS_HZ, sds[reading], strict=True)
        ),
        agrees=f"Read {reading}, the arm moves as far as the paper says it did.",
        differs=f"Read {reading}, the arm does not move as far as the paper says it did; J_c would "
        f"be {number(controller.inertia_kg_m2 / printed.SEC_34.inertia_kg_m2, 2)} times the arm's "
        "own inertia.",
    )


def equation_4(context: Context) -> Claim:
    """Compare the motion under voluntary torque with that of arm and controller together."""
    controller, joint = context.settings.controller, printed.SEC_34
    frequency_hz = np.array([0.3, 1.0, 4.0])
    loop = Loop(controller, context.settings.rig).at_frequency(frequency_hz)
    # M_sub is subtracted from the measured torque.
    found = -loop.motion_per_torque(joint.parameters)[2]
    together = JointDynamics(
        joint.inertia_kg_m2 + controller.inertia_kg_m2,
        joint.damping_nm_s_rad + controller.damping_nm_s_rad,
        joint.stiffness_nm_rad,
    )
    ratio = np.abs(found / together.compliance_rad_nm(frequency_hz))
    off_percent = {
        float(hz): 100.0 * abs(float(each) - 1.0)
        for hz, each in zip(frequency_hz, ratio, strict=True)
    }
    per_hz = ", ".join(f"{number(off, 2)} % at {hz:g} Hz" for hz, off in off_percent.items())
    return Claim(
        ours=f"|θ/M_sub| of the loop with sensor, 20 Hz filter and drive is off by {per_hz}",
        checks=tuple(
            bounded(f"|θ/M_sub| at {hz:g} Hz against Eq. 4", "%", off, high=LOOP_PERCENT)
            for hz, off in off_percent.items()
        ),
    )


def equation_5(context: Context) -> Claim:
    """Compare the measured torque with the perturbation less the controller.

    With the torque filter F and the drive D, from the command to the velocity,

        J_c c' + B_c c = M_PRBS − F M_meas,    v = D c

    so Eq. 5, which has v for c and M_meas for F M_meas, leaves out what filter and drive add.
    """
    settings = context.settings
    paper, fast = _equation_5_percent(settings), _equation_5_percent(_fast(settings))
    return Claim(
        ours="within 0.15 to 10 Hz the two sides differ by "
        f"{number(paper, 3)} % of M_meas with the 20 Hz filter and a "
        f"{settings.rig.drive_bandwidth_hz:g} Hz drive, and by {number(fast, 3)} % with filter and "
        f"drive of {_FAST_HZ:g} Hz",
        checks=(bounded("The two sides, of M_meas", "%", paper, high=LOOP_PERCENT),),
    )


def _fast(settings: Settings) -> Settings:
    controller = settings.controller.model_copy(update={"torque_cutoff_hz": _FAST_HZ})
    torque = settings.rig.torque.model_copy(
        update={"rate_hz": 5000.0, "latency_s": 0.0, "stamp_latency_s": 0.0}
    )
    rig = settings.rig.model_copy(
        update={"tick_rate_hz": 5000.0, "drive_bandwidth_hz": _FAST_HZ, "torque": torque}
    )
    return settings.model_copy(update={"controller": controller, "rig": rig})


def _equation_5_percent(settings: Settings) -> float:
    """Return what is left of Eq. 5 within the band of the perturbation, in % of M_meas."""
    rate_hz, controller = settings.rig.tick_rate_hz, settings.controller
    perturbation = prbs_nm(settings.prbs, rate_hz)
    motion = closed_loop_motion(perturbation, settings, printed.SEC_34)
    acceleration, velocity = motion.acceleration_rad_s2, motion.velocity_rad_s
    measured = printed.SEC_34.torque_nm(motion.angle_rad, velocity, acceleration)
    left = measured - (
        perturbation
        - controller.inertia_kg_m2 * acceleration
        - controller.damping_nm_s_rad * velocity
    )
    frequency_hz = np.fft.rfftfreq(left.size, 1.0 / rate_hz)
    inside = (frequency_hz >= printed.EXCITED_HZ[0]) & (frequency_hz <= printed.EXCITED_HZ[1])
    rest, whole = (
        float(np.sum(np.abs(np.fft.rfft(values)[inside]) ** 2)) for values in (left, measured)
    )
    return 100.0 * math.sqrt(rest / whole)
