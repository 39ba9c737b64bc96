"""Limbs from a finger to a knee, and a rig that suits each: what its settings say."""

from __future__ import annotations

from typing import NamedTuple

from tests.scenarios.perturbations import Perturbation
from tests.scenarios.plant import Controller, Drive, Joint, TorquePath
from tests.scenarios.recordings import Setup
from tests.scenarios.sensors import Sensor
from tests.scenarios.subject import Subject

from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.core.units import rad_from_deg


class Limb(NamedTuple):
    """A joint, and how strong and yielding the rig for it is.

    Attributes
    ----------
    joint : Joint
    size : float
        Admittance, perturbation and torque sensor are those for the animal's elbow, whose size is
        1, times this.
    """

    joint: Joint
    size: float


LIMBS = {
    "animal elbow": Limb(Joint(0.0045, 0.1368, 1.751), 1.0),
    "finger": Limb(Joint(2e-5, 0.0025, 0.15), 0.08),
    "wrist": Limb(Joint(0.003, 0.03, 1.0), 0.5),
    "elbow": Limb(Joint(0.07, 0.9, 12.0), 5.0),
    "ankle": Limb(Joint(0.015, 0.9, 60.0), 12.0),
    "knee": Limb(Joint(0.4, 2.5, 40.0), 16.0),
}
_SENSOR = 0.005, 0.0005
"""Noise and resolution at size 1, in N·m."""
_CONTROLLER = 0.0458366, 1.604282
"""J_c and B_c at size 1: 0.0008 and 0.028 per degree."""


def setup_of(limb: Limb) -> Setup:
    """Return the limb on its rig, everything as the settings say, the subject at rest."""
    inertia, damping = (limb.size * value for value in _CONTROLLER)
    noise, step = (limb.size * value for value in _SENSOR)
    return Setup(
        joint=limb.joint,
        controller=Controller(inertia, damping),
        drive=Drive(),
        path=TorquePath(),
        torque=Sensor(noise=noise, step=step),
        motion=Sensor(step=rad_from_deg(2.25e-4), rate_step=rad_from_deg(0.01)),
        perturbation=Perturbation(amplitude_nm=limb.size),
        subject=Subject(),
    )


def settings_of(limb: Limb) -> Settings:
    """Return the settings with which a recording of that limb is analysed."""
    setup = setup_of(limb)
    most_nm = 10.0 * max(limb.size, 1.0)
    return parse_settings(
        {
            "controller": {
                "inertia_kg_m2": setup.controller.inertia_kg_m2,
                "damping_nm_s_rad": setup.controller.damping_nm_s_rad,
            },
            "guard": {"torque_limit_nm": most_nm, "torque_stop_nm": 2 * most_nm},
            "prbs": {"amplitude_nm": setup.perturbation.amplitude_nm},
            "rig": {
                "torque": {"noise_sd_nm": setup.torque.noise, "resolution_nm": setup.torque.step}
            },
        }
    )
