"""What the independent simulator knows of joint, drive and torque path: numbers, no behaviour.

Every field is a number, so that compiled code takes the records as they are. Zero leaves a term
out. Nothing here or in `motion` comes from `rigidimeter.model`: the estimation is measured with
equations that it does not hold itself.
"""

from __future__ import annotations

from typing import NamedTuple

SECOND_ORDER, VELOCITY_PI, POSITION_LOOP, TORQUE_MOTOR = 0, 1, 2, 3
"""Kinds of drive."""


class Joint(NamedTuple):
    """A limb about one axis; torque that drives it toward positive angle is positive.

    J w' + B b(t) (1 ± a) w + e(q, t) + c tanh(w / w0) + gravity + reflex + cogwheel = M + M_sub,
    with the elastic torque

        e = K k(t) (x + κ q_s ln cosh(x / q_s)) + K3 x³,    x = q − q0(t),

    whose slope is K (1 + κ tanh(x / q_s)) + 3 K3 x². The courses k, b, q0 and M_sub are in
    `courses`.

    Attributes
    ----------
    inertia_kg_m2, damping_nm_s_rad, stiffness_nm_rad : float
        J, B and K: what is called the truth.
    damping_asymmetry : float
        a, with + while the joint moves toward positive angle: 0.5 is 3 to 1.
    angle_share, angle_scale_rad : float
        κ and q_s.
    cubic_nm_rad3, coulomb_nm : float
        K3 and c.
    gravity_nm, gravity_angle_rad : float
        m g l, and the angle from the vertical at which the sensor was zeroed.
    reflex_nm_s_rad, reflex_delay_s, reflex_threshold_rad_s : float
        Torque against a stretch, per velocity above the threshold, so much later.
    reflex_sides : float
        1: motion toward positive angle alone stretches; 2: motion either way.
    resist_nm_rad : float
        Torque against the displacement of the reflex's delay before.
    reflex_hz : float
        Double pole of the muscle between these two and their torque.
    cogwheel_nm : float
        Height of the bursts that oppose the motion, whose timing is a course.
    cuff_nm_rad, cuff_nm_s_rad : float
        What lies between the sensor and the limb; 0: nothing, they move alike.
    """

    inertia_kg_m2: float
    damping_nm_s_rad: float
    stiffness_nm_rad: float
    damping_asymmetry: float = 0.0
    angle_share: float = 0.0
    angle_scale_rad: float = 0.05
    cubic_nm_rad3: float = 0.0
    coulomb_nm: float = 0.0
    gravity_nm: float = 0.0
    gravity_angle_rad: float = 0.0
    reflex_nm_s_rad: float = 0.0
    reflex_delay_s: float = 0.04
    reflex_threshold_rad_s: float = 0.0
    reflex_sides: float = 1.0
    resist_nm_rad: float = 0.0
    reflex_hz: float = 0.0
    cogwheel_nm: float = 0.0
    cuff_nm_rad: float = 0.0
    cuff_nm_s_rad: float = 0.0


class Drive(NamedTuple):
    """What carries out the velocity command c.

    `SECOND_ORDER`: v'' + 2 ζ ω v' + ω² v = ω² c, whatever the load.
    `VELOCITY_PI`: J_m v' = τ − friction − load, τ a PI of c − v that without load has its poles at
    ω and ζ, behind the lag of the current loop. The load of a stiff limb is part of the same mass.
    `POSITION_LOOP`: the command is summed to a position, and ``position_gain_per_s`` times the
    distance to it is the velocity asked of a second-order drive.
    `TORQUE_MOTOR`: J_m v' = p − M: the perturbation p, held from tick to tick, without a loop.

    Attributes
    ----------
    kind : float
    bandwidth_hz, damping_ratio : float
        ω / 2π and ζ.
    delay_s, lag_s : float
        Of the command: pure, and of first order.
    inertia_kg_m2, friction_nm : float
        Of the motor, before the sensor.
    current_lag_s, position_gain_per_s : float
    """

    kind: float = SECOND_ORDER
    bandwidth_hz: float = 50.0
    damping_ratio: float = 0.7071
    delay_s: float = 0.0
    lag_s: float = 0.0
    inertia_kg_m2: float = 0.05
    friction_nm: float = 0.0
    current_lag_s: float = 0.0005
    position_gain_per_s: float = 40.0


class TorquePath(NamedTuple):
    """Between the true torque and its samples.

    Attributes
    ----------
    lowpass_hz : float
        A Butterworth filter of second order; 0 for none.
    crosstalk_nm : float
        Of the limb's weight: the reading falls by this times 1 − cos θ.
    crosstalk_nm_s2_rad2 : float
        Of its centripetal force: the reading rises by this times θ'².
    """

    lowpass_hz: float = 0.0
    crosstalk_nm: float = 0.0
    crosstalk_nm_s2_rad2: float = 0.0


class Controller(NamedTuple):
    """The admittance J_c v' + B_c v = M_perturbation − F M, and the low-pass F.

    Attributes
    ----------
    inertia_kg_m2, damping_nm_s_rad : float
    torque_cutoff_hz : float
    tick_rate_hz : float
    late, late_s : float
        Share of the ticks that are late, and by how much in the mean. Those that are due meanwhile
        are missed.
    """

    inertia_kg_m2: float
    damping_nm_s_rad: float
    torque_cutoff_hz: float = 20.0
    tick_rate_hz: float = 1000.0
    late: float = 0.0
    late_s: float = 0.001
