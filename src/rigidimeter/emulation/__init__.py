"""Wire emulators: a sensor and drives that answer on a true wire, and misbehave when told to."""

from rigidimeter.emulation.emulated_arm import EmulatedArm

__all__ = ["EmulatedArm"]
