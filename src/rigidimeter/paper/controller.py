"""The admittance controller: in what unit its two numbers are, and Eq. 4 and 5.

Sec. 2.4.2 prints J_c and B_c per degree, App. A the same two numbers per radian: 57.3 times apart.
Only the motion can tell. In the ideal loop

    (J_c + J_p) θ'' + (B_c + B_p) θ' + K_p θ = M_PRBS

each reading has its position SD, and the paper reports about 4 deg.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from rigidimeter.dynamics import Loop, closed_loop_motion, loop_margins
from rigidimeter.experiment import ideal_response, prbs_nm
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import AGREES, DIFFERS, Check, Row, bounded, within_percent
from rigidimeter.paper.context import Workshop
from rigidimeter.reporting.numbers import number
from rigidimeter.settings import ControllerSettings, PrbsSettings, Settings
from rigidimeter.units import deg_from_rad, per_rad_from_per_deg

__all__ = ["CLOCKS_HZ", "READINGS", "ROWS", "position_sd_deg"]

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


def position_sd_deg(reading: str, clock_hz: float) -> float:
    """Return the SD of the angle in the ideal loop with the joint of Sec. 3.4, in deg."""
    rate_hz = Settings().rig.tick_rate_hz
    angle, _ = ideal_response(
        prbs_nm(PrbsSettings(clock_hz=clock_hz), rate_hz),
        READINGS[reading],
        printed.SEC_34,
        rate_hz,
    )
    return deg_from_rad(float(np.std(angle)))


def _sd_checks(reading: str) -> tuple[Check, ...]:
    return tuple(
        within_percent(
            f"Position SD read {reading}, clock {clock_hz:g} Hz",
            "deg",
            printed.POSITION_SD_DEG,
            position_sd_deg(reading, clock_hz),
            ABOUT_PERCENT,
        )
        for clock_hz in CLOCKS_HZ
    )


def _stability(reading: str) -> str:
    settings = Settings(controller=READINGS[reading])
    margins = loop_margins(settings, printed.SEC_34)
    word = "stable" if margins.stable else "unstable"
    return (
        f"the loop with the 20 Hz filter and a {settings.rig.drive_bandwidth_hz:g} Hz drive is "
        f"{word} (gain margin {number(margins.gain_margin_db, 3)} dB)"
    )


def _in_si(reading: str) -> str:
    controller = READINGS[reading]
    return (
        f"J_c = {number(controller.inertia_kg_m2)} kg·m²/rad, "
        f"B_c = {number(controller.damping_nm_s_rad)} N·m·s/rad"
    )


def nearest_reading() -> str:
    """Return the reading whose position SD is nearest to the paper's, by ratio."""

    def distance(reading: str) -> float:
        return sum(
            abs(math.log(position_sd_deg(reading, clock) / printed.POSITION_SD_DEG))
            for clock in CLOCKS_HZ
        )

    return min(READINGS, key=distance)


def _units_row(workshop: Workshop, row_id: str, source: str, reading: str, text: str) -> Row:
    checks = _sd_checks(reading)
    chosen = nearest_reading()
    spread = " and ".join(number(check.ours, 3) for check in checks)
    same = " (the ideal loop with a 7-bit PRBS at 20 and 22.6 Hz)"
    return Row(
        id=row_id,
        source=source,
        paper=f"{text}; position SD approximately {printed.POSITION_SD_DEG:g} deg",
        ours=f"{_in_si(reading)}: position SD {spread} deg{same}; {_stability(reading)}",
        reading=f"Read {chosen}: of the two readings its position SD is nearest to the paper's.",
        checks=checks,
        because={
            AGREES: f"Read {reading}, the arm moves as far as the paper says it did.",
            DIFFERS: f"Read {reading}, the arm does not move as far as the paper says it did; "
            f"J_c would be {number(_share_of_arm(reading), 2)} times the arm's own inertia.",
        },
    )


def _share_of_arm(reading: str) -> float:
    return READINGS[reading].inertia_kg_m2 / printed.SEC_34.inertia_kg_m2


def units_per_degree(workshop: Workshop) -> Row:
    """Make the row: J_c and B_c as Sec. 2.4.2 prints them."""
    text = "J_c = 0.0008 kg·m²/deg, B_c = 0.028 N·m·s/deg"
    return _units_row(workshop, "sec-2.4.2-units", "Sec. 2.4.2", "per degree", text)


def units_per_radian(workshop: Workshop) -> Row:
    """Make the row: J_c and B_c as App. A prints them."""
    text = "J_c = 0.0008 kg·m²/rad, B_c = 0.028 N·m·s/rad"
    return _units_row(workshop, "app-a-units", "App. A", "per radian", text)


def equation_4(workshop: Workshop) -> Row:
    """Make the row: voluntary torque moves arm and controller as one."""
    controller, joint = workshop.settings.controller, printed.SEC_34
    frequency_hz = np.array([0.3, 1.0, 4.0])
    loop = Loop(controller, workshop.settings.rig).at_frequency(frequency_hz)
    # M_sub is subtracted from the measured torque.
    found = -loop.motion_per_torque(joint.parameters)[2]
    s = 2j * np.pi * frequency_hz
    J = joint.inertia_kg_m2 + controller.inertia_kg_m2
    B = joint.damping_nm_s_rad + controller.damping_nm_s_rad
    wanted = 1.0 / (J * s**2 + B * s + joint.stiffness_nm_rad)
    off_percent = 100.0 * np.abs(np.abs(found / wanted) - 1.0)
    per_hz = ", ".join(
        f"{number(float(off), 2)} % at {hz:g} Hz"
        for off, hz in zip(off_percent, frequency_hz, strict=True)
    )
    return Row(
        id="eq-4",
        source="Eq. 4",
        paper="[J_p θ″ + B_p θ′ + K_p θ] + [J_c θ″ + B_c θ′] = M_sub",
        ours=f"|θ/M_sub| of the loop with sensor, 20 Hz filter and drive is off by {per_hz}",
        reading="Without perturbation. In the band of voluntary movement, 0.3 to 4 Hz; above it "
        "filter and drive count.",
        checks=tuple(
            bounded(f"|θ/M_sub| at {hz:g} Hz against Eq. 4", "%", float(off), high=LOOP_PERCENT)
            for off, hz in zip(off_percent, frequency_hz, strict=True)
        ),
        because={AGREES: "Controller and arm add up as printed."},
    )


def equation_5(workshop: Workshop) -> Row:
    """Make the row: measured torque against perturbation less controller."""
    settings = workshop.settings
    off = {
        "fast": _equation_5_percent(_fast(settings)),
        "paper": _equation_5_percent(settings),
    }
    return Row(
        id="eq-5",
        source="Eq. 5",
        paper="M_meas = [J_p θ″ + B_p θ′ + K_p θ] − M_sub = M_PRBS − [J_v θ″ + B_v θ′]",
        ours="within 0.15 to 10 Hz the two sides differ by "
        f"{number(off['fast'], 3)} % of M_PRBS with a torque filter and a drive of "
        f"{_FAST_HZ:g} Hz, and by {number(off['paper'], 3)} % with the 20 Hz filter and a "
        f"{settings.rig.drive_bandwidth_hz:g} Hz drive",
        reading="J_v and B_v are J_c and B_c of Eq. 4; M_meas is the torque that drives the arm, "
        "so its sign is that of the perturbation.",
        checks=(
            bounded("The two sides in a fast loop, of M_PRBS", "%", off["fast"], high=LOOP_PERCENT),
        ),
        because={
            AGREES: "In a loop faster than the motion it holds; what filter and drive add is why "
            "the torque is measured and not computed from the right side."
        },
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
    """Return what is left of Eq. 5 within the band of the perturbation, in % of M_PRBS."""
    rate_hz = settings.rig.tick_rate_hz
    perturbation = prbs_nm(settings.prbs, rate_hz)
    motion = closed_loop_motion(perturbation, settings, printed.SEC_34)
    controller = settings.controller
    torque = printed.SEC_34.torque_nm(
        motion.angle_rad, motion.velocity_rad_s, motion.acceleration_rad_s2
    )
    left = torque - (
        perturbation
        - controller.inertia_kg_m2 * motion.acceleration_rad_s2
        - controller.damping_nm_s_rad * motion.velocity_rad_s
    )
    frequency_hz = np.fft.rfftfreq(torque.size, 1.0 / rate_hz)
    inside = (frequency_hz >= printed.BAND_HZ[0]) & (frequency_hz <= printed.BAND_HZ[1])
    rest, whole = (
        float(np.sum(np.abs(np.fft.rfft(values)[inside]) ** 2)) for values in (left, perturbation)
    )
    return 100.0 * math.sqrt(rest / whole)


ROWS: Mapping[str, Callable[[Workshop], Row]] = {
    "sec-2.4.2-units": units_per_degree,
    "app-a-units": units_per_radian,
    "eq-4": equation_4,
    "eq-5": equation_5,
}
