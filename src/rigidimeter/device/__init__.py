"""The outside world, behind one small protocol."""

from rigidimeter.device.base import Reading, Rig
from rigidimeter.device.simulated import SimulatedRig

__all__ = ["Reading", "Rig", "SimulatedRig"]
