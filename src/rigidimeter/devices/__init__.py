"""The outside world, behind one small protocol."""

from rigidimeter.devices.base import Reading, Rig
from rigidimeter.devices.simulated import SimulatedRig

__all__ = ["Reading", "Rig", "SimulatedRig"]
