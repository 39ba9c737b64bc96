"""Every scenario, in the order of the table.

Torques are those of the animal's elbow (J 0.0045 kg·m², B 0.137 N·m·s/rad, K 1.75 N·m/rad, PRBS of
1 N·m, about 4 deg of motion) unless a limb is named; limbs have theirs in proportion to their rig.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from tests.scenarios.limbs import LIMBS
from tests.scenarios.plant import POSITION_LOOP, TORQUE_MOTOR, VELOCITY_PI
from tests.scenarios.scenario import Scenario, scenario

OWN = ("voluntary_torque", "active_movement", "residual_perturbation", "tremor", "loop_bias")
"""The subject's own torque."""

TERM = ("missing_term", "lack_of_fit", "residual_perturbation", "loop_bias")
"""The joint is not J, B and K alone."""

DRIVE = ("between_samples", "lack_of_fit")
"""What the drive does between the samples is not known."""

CLOCK = ("velocity_delay", "torque_delay", *DRIVE)
"""Stamps, rates and filters."""

STORED = ("velocity_delay", "velocity_shape")
"""What was stored as the velocity is not that of the angle."""

another = partial(scenario, other_model=True)
"""A joint that is not one J, B and K."""


def _subject() -> Iterator[Scenario]:
    yield scenario("relaxed")
    yield scenario("relaxed, multisine", perturbation={"kind": "multisine"})
    for torque_nm in (0.05, 0.2, 0.5):
        yield scenario(f"voluntary {torque_nm} N·m", OWN, subject={"voluntary_nm": torque_nm})
    skirts = {"voluntary_nm": 0.2, "voluntary_skirts": True}
    yield scenario("voluntary 0.2 N·m, soft skirts", OWN, subject=skirts)
    wide = {"voluntary_nm": 0.5, "voluntary_hz": (0.3, 30.0)}
    yield scenario("voluntary 0.5 N·m, 0.3 to 30 Hz", OWN, subject=wide)
    yield another(
        "resists after 0.5 s, 0.5 N·m/rad",
        (*TERM, *OWN),
        joint={"resist_nm_rad": 0.5, "reflex_delay_s": 0.5, "reflex_hz": 2.0},
    )
    yield scenario("voluntary bursts 0.3 N·m", OWN, subject={"bursts_nm": 0.3})
    for torque_nm in (0.1, 0.3, 1.0):
        yield scenario(f"tremor {torque_nm} N·m", OWN, subject={"tremor_nm": torque_nm})
    yield another("cogwheel 0.3 N·m", (*TERM, *OWN), joint={"cogwheel_nm": 0.3})
    yield scenario("posture drifts 0.1 rad", OWN, subject={"posture_rad": 0.1})


def _stiffness() -> Iterator[Scenario]:
    varying = ("varying", "loop_bias")
    for course in ("step", "drift"):
        yield another(
            f"K {course} 0.7 to 1.3",
            varying,
            subject={"stiffness": course, "stiffness_depth": 0.3},
        )
    yield another("K 2:1 by angle", (*varying, *TERM), joint={"angle_share": 1 / 3})
    moved = {"imposed_rad": np.radians(6.0), "imposed_hz": 0.5}
    yield scenario("imposed movement", subject=moved)
    yield another(
        "K by phase of movement, ±40 %",
        varying,
        subject={**moved, "stiffness": "phase", "stiffness_depth": 0.4},
    )
    yield another(
        "K 0.6, 1.2, 0.8, 1.4 by epoch", varying, subject={"between": (0.6, 1.2, 0.8, 1.4)}
    )
    tools = {"tool_kg_m2": (0.0, 0.0, 0.0015, 0.0015)}
    yield another("J a third larger in half the epochs", varying, subject=tools)


def _terms() -> Iterator[Scenario]:
    for delay_s, gain in ((0.035, 0.05), (0.035, 0.15), (0.045, 0.15), (0.06, 0.15), (0.06, 0.3)):
        yield another(
            f"reflex {1e3 * delay_s:.0f} ms, {gain}",
            TERM,
            joint={"reflex_nm_s_rad": gain, "reflex_delay_s": delay_s},
        )
    yield another(
        "reflex 60 ms, 0.3, both sides",
        TERM,
        joint={"reflex_nm_s_rad": 0.3, "reflex_delay_s": 0.06, "reflex_sides": 2.0},
    )
    yield another(
        "reflex 40 ms, 0.3, slow muscle",
        TERM,
        joint={"reflex_nm_s_rad": 0.3, "reflex_delay_s": 0.04, "reflex_hz": 5.0},
    )
    for torque_nm in (0.02, 0.1):
        yield another(
            f"friction in the joint {torque_nm} N·m", TERM, joint={"coulomb_nm": torque_nm}
        )
    turned = {"joint": {"coulomb_nm": 0.1}}
    yield another(
        "friction 0.1 N·m, tremor 1.0 N·m", (*TERM, *OWN), **turned, subject={"tremor_nm": 1.0}
    )
    moved = {"imposed_rad": np.radians(10.0), "imposed_hz": 0.5}
    yield another("friction 0.1 N·m, imposed movement", (*TERM, "varying"), **turned, subject=moved)
    yield another("damping 3:1 by direction", TERM, joint={"damping_asymmetry": 0.5})
    yield another("cubic stiffness 40 N·m/rad³", (*TERM, "varying"), joint={"cubic_nm_rad3": 40.0})
    yield another(
        "gravity 0.5 N·m at 45°",
        TERM,
        joint={"gravity_nm": 0.5, "gravity_angle_rad": np.pi / 4},
    )
    for cuff in (200.0, 60.0, 20.0):
        yield another(
            f"cuff {cuff:.0f} N·m/rad", TERM, joint={"cuff_nm_rad": cuff, "cuff_nm_s_rad": 0.05}
        )


def _sensors() -> Iterator[Scenario]:
    yield scenario("torque drifts 0.1 N·m", OWN, subject={"sensor_drift_nm": 0.1})
    yield scenario(
        "cross-talk",
        OWN,
        path={"crosstalk_nm": 0.1, "crosstalk_nm_s2_rad2": 0.002},
        subject={"lateral_nm": 0.05},
    )
    yield scenario(
        "encoder 0.05°, no velocity", DRIVE, motion={"step": np.radians(0.05)}, velocity=False
    )
    for noise_mrad in (0.2, 0.5):
        noisy = {"noise": 1e-3 * noise_mrad}
        yield scenario(
            f"encoder noise {noise_mrad} mrad, no velocity", motion=noisy, velocity=False
        )
    for name, how in (
        ("differenced", {"rate_differenced": True}),
        ("behind 40 Hz", {"rate_lowpass_hz": 40.0}),
        ("in steps of 2°/s", {"rate_step": np.radians(2.0)}),
    ):
        yield scenario(f"velocity {name}", STORED, motion=how)
    yield scenario("torque filter 100 Hz", CLOCK, path={"lowpass_hz": 100.0})
    yield scenario("torque stamped 4 ms late", CLOCK, torque={"late_s": 0.004})
    yield scenario(
        "5 % lost, stamps ±0.3 ms",
        CLOCK,
        torque={"lost": 0.05, "stamp_noise_s": 0.0003},
        motion={"lost": 0.05, "stamp_noise_s": 0.0003},
    )
    yield scenario(
        "torque 100/s, motion 50/s, jitter",
        CLOCK,
        settings={
            "rig": {"torque": {"rate_hz": 100.0}, "motion": {"rate_hz": 50.0, "jitter_s": 0.005}}
        },
        torque={"rate_hz": 100.0},
        motion={"rate_hz": 50.0, "jitter_s": 0.005},
    )


def _drives() -> Iterator[Scenario]:
    yield scenario("drive 15 Hz, 5 ms late", DRIVE, drive={"bandwidth_hz": 15.0, "delay_s": 0.005})
    yield scenario("drive lag 10 ms", DRIVE, drive={"lag_s": 0.01})
    for bandwidth_hz in (20.0, 50.0):
        yield scenario(
            f"drive PI {bandwidth_hz:.0f} Hz with load",
            DRIVE,
            drive={"kind": VELOCITY_PI, "bandwidth_hz": bandwidth_hz},
        )
    slow = {"tick_rate_hz": 500.0}
    yield scenario(
        "drive PI 30 Hz, 500/s",
        DRIVE,
        settings={"rig": {**slow, "torque": {"rate_hz": 500.0}, "motion": {"rate_hz": 500.0}}},
        controller=slow,
        torque={"rate_hz": 500.0},
        motion={"rate_hz": 500.0},
        drive={"kind": VELOCITY_PI, "bandwidth_hz": 30.0},
    )
    yield scenario(
        "friction in the drive 3 N·m",
        DRIVE,
        drive={"kind": VELOCITY_PI, "bandwidth_hz": 50.0, "friction_nm": 3.0},
    )
    motor = {"drive": {"kind": TORQUE_MOTOR}, "perturbation": {"amplitude_nm": 0.3}}
    yield scenario("torque motor", CLOCK, **motor, velocity=False)
    for late_s in (0.002, 0.005):
        yield scenario(
            f"torque motor, torque {1e3 * late_s:.0f} ms late",
            CLOCK,
            **motor,
            torque={"late_s": late_s},
            velocity=False,
        )
    yield scenario("slow position loop 40/s", DRIVE, drive={"kind": POSITION_LOOP})
    yield scenario("2 % of ticks late, 1 ms", controller={"late": 0.02})
    yield scenario(
        "controller twice the settings",
        controller={"inertia_kg_m2": 0.0916732, "damping_nm_s_rad": 3.208564},
    )


def _limbs() -> Iterator[Scenario]:
    for name, limb in LIMBS.items():
        if name == "animal elbow":
            continue
        yield scenario(f"{name}, relaxed", limb=name)
        pushed = {"voluntary_nm": 0.2 * limb.size}
        yield scenario(
            f"{name}, voluntary {pushed['voluntary_nm']:.3g} N·m", OWN, name, subject=pushed
        )
        shaken = {"tremor_nm": 0.2 * limb.size}
        yield scenario(f"{name}, tremor {shaken['tremor_nm']:.3g} N·m", OWN, name, subject=shaken)
    yield another(
        "elbow of a patient: tremor, bursts, friction, reflex, drift",
        (*TERM, *OWN, "varying"),
        "elbow",
        joint={"coulomb_nm": 0.15, "reflex_nm_s_rad": 0.5, "cogwheel_nm": 0.5},
        subject={"tremor_nm": 0.5, "bursts_nm": 1.0, "posture_rad": 0.05},
    )


SCENARIOS: dict[str, Scenario] = {
    found.name: found
    for family in (_subject, _stiffness, _terms, _sensors, _drives, _limbs)
    for found in family()
}
