"""Emulated sensors and drives that use real communication and can be made to misbehave."""

from rigidimeter.emulation.emulated_arm import EmulatedArm
