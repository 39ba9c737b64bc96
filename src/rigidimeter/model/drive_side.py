"""What a drive's motor must give so that the joint gets its torque, seen at the joint.

    T = M + J_d θ″ + F                               a T_reported = T

with T the motor's torque, M the torque that the drive applies to the joint (what the torque sensor
measures, positive toward positive angle), J_d the inertia of motor and gear times the square of the
gear ratio, and F the friction between motor and joint, which opposes the motion. a is what the
drive's own scale (its torque constant, its rated torque, the gear) is wrong by.

F is Dahl's: a spring that slips. With x the displacement of the motor's side,

    dF/dx = σ (1 − sgn(dx) F / F_c(θ))               F_c(θ) = F_0 (1 + r sin 2πθ/p)

so F = ±F_c in steady motion, turns from one to the other within some `PRESLIDING_RAD` = F_0/σ, and
holds what it had when the motion ended. r and p are the ripple of a gear, whose friction varies
with the angle of its input shaft. A drive at rest is not rigid: where the load L = M + J_d θ″
changes, it yields by dx = dθ − h dL/σ, and the friction takes up the part h of the load until it
slips. So a drive at rest makes any torque between L − F_c and L + F_c, by what came before: from
F = 0 a slowly growing load leaves T = L − F_c (1 − exp(−h L/F_c)).

With F_c constant over a step, F after a displacement Δx is exact:

    F → s F_c + (F − s F_c) exp(−σ |Δx| / F_c),      s = sgn(Δx)

References
----------
Dahl, P. (1968). A solid friction model. Aerospace Corporation, TOR-0158(3107-18)-1.
Tuttle, T. and Seering, W. (1996). A nonlinear model of a harmonic drive gear transmission. IEEE
Trans. Robotics and Automation 12, 368–374.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rigidimeter.core.settings import DriveSideSettings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.model.sensors import quantised

PRESLIDING_RAD = 1e-3
"""How far friction stretches before it slips, at the joint: a tenth of a radian of a motor with a
gear of 100."""

HELD = 0.5
"""Part of a changing load that the friction of a drive at rest takes up, before it slips."""


class DriveSide(NamedTuple):
    """Coefficients of the drive's side; `stiffness_nm_rad` is σ, `waves_per_rad` 2π/p."""

    reflected_inertia_kg_m2: float
    friction_nm: float
    ripple: float
    waves_per_rad: float
    stiffness_nm_rad: float
    torque_scale: float
    torque_step_nm: float


class DriveSideState(NamedTuple):
    """Where the joint was, the load M + J_d θ″ on the motor, and the friction F."""

    angle_rad: float = 0.0
    load_nm: float = 0.0
    friction_nm: float = 0.0


def drive_side(settings: DriveSideSettings) -> DriveSide:
    """Return the coefficients of the settings."""
    return DriveSide(
        settings.reflected_inertia_kg_m2,
        settings.friction_nm,
        settings.friction_ripple_percent / 100.0,
        2.0 * math.pi / rad_from_deg(settings.friction_ripple_deg),
        settings.friction_nm / PRESLIDING_RAD,
        settings.torque_scale,
        settings.rated_torque_nm * settings.torque_resolution_percent / 100.0,
    )


def drive_side_step(
    side: DriveSide,
    state: DriveSideState,
    angle_rad: float,
    acceleration_rad_s2: float,
    torque_nm: float,
) -> DriveSideState:
    """Return the state after the joint moved to an angle, without turning back on the way.

    Parameters
    ----------
    side : DriveSide
    state : DriveSideState
        Before.
    angle_rad, acceleration_rad_s2 : float
        Of the joint now.
    torque_nm : float
        M now, as it truly is: without the noise of a sensor.
    """
    inertia, level, ripple, waves, stiffness, _, _ = side
    angle_before, load_before, friction = state
    load = torque_nm + inertia * acceleration_rad_s2
    if level == 0.0:
        return DriveSideState(angle_rad, load, 0.0)
    slipping = level * (1.0 + ripple * math.sin(waves * angle_rad))
    stretch_nm = stiffness * (angle_rad - angle_before) - HELD * (load - load_before)  # σ Δx
    limit = slipping if stretch_nm > 0.0 else -slipping
    friction = limit + (friction - limit) * math.exp(-abs(stretch_nm) / slipping)
    return DriveSideState(angle_rad, load, friction)


def reported_torque_nm(side: DriveSide, state: DriveSideState) -> float:
    """Return the motor's torque by the drive's own scale, in its steps: T / a."""
    torque_nm = (state.load_nm + state.friction_nm) / side.torque_scale
    return quantised(torque_nm, side.torque_step_nm)
