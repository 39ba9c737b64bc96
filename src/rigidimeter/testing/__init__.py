"""Emulated sensors and drives on real interfaces, and the conformance checks of drivers."""

from rigidimeter.testing.ascii_emulator import ASCII_MISBEHAVIOURS, AsciiEmulator
from rigidimeter.testing.cia402.cia402_emulator import Cia402Emulator
from rigidimeter.testing.cia402.object_dictionary import dictionary
from rigidimeter.testing.cia402.servo import (
    CIA402_MISBEHAVIOURS,
    POWERED,
    UNITS_PER_RAD,
    Phase,
    Servo,
    after_control,
    statusword,
)
from rigidimeter.testing.conformance import (
    DRIVE_CHECKS,
    SENSOR_CHECKS,
    DriveFixture,
    OtherEnd,
    SensorFixture,
)
from rigidimeter.testing.conformance.drive_checks import drive_stops_by_itself
from rigidimeter.testing.conformance.fixture import ConformanceError
from rigidimeter.testing.conformance.sensor_checks import sensor_samples_flow
from rigidimeter.testing.emulated_arm import EmulatedArm
from rigidimeter.testing.emulated_rig import EmulatedRig, serve
from rigidimeter.testing.rdt.rdt_emulator import RdtEmulator
from rigidimeter.testing.rdt.rdt_records import RDT_MISBEHAVIOURS
from rigidimeter.testing.trapezoid import Ramps, Trapezoid
