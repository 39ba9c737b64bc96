"""Torque sensors, drives and rigs, behind the protocols of `base`."""

from rigidimeter.devices.base import Reading, Rig
from rigidimeter.devices.simulated import SimulatedRig

__all__ = ["Reading", "Rig", "SimulatedRig"]
