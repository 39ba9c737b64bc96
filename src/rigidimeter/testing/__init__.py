"""Emulated sensors and drives on real interfaces, and the conformance checks of drivers."""

from rigidimeter.testing.emulated_arm import EmulatedArm
