"""Torque sensors, drives and rigs, behind the protocols of `base`."""

from rigidimeter.devices.base import Reading
from rigidimeter.devices.simulated import SimulatedRig
