"""What an operator can do about each cause for which the rig was stopped or held."""

from __future__ import annotations

from rigidimeter.rig.guard import Cause

_CABLE = "check cable, plug and power of the torque sensor, then `rigidimeter check`"
_DRIVE = "read the fault on the drive itself, remove it, then `rigidimeter check`"
_PROCESSOR = (
    "run it on a processor of its own with `--cpu N`, close other programs, or lower "
    "rig.tick_rate_hz"
)
_PUSH = (
    "wait until the subject is relaxed, or raise the limit if the person responsible for the rig "
    "agrees"
)

SUSPENDED = "the computer was suspended: disable suspend, also for a closed lid"

REMEDIES: dict[Cause, str] = {
    Cause.NONE: "nothing is to be done",
    Cause.TORQUE_NOT_FINITE: _CABLE,
    Cause.MOTION_NOT_FINITE: "check the encoder's cable and plug, then `rigidimeter check`",
    Cause.COMMAND_NOT_FINITE: "please report this with the session folder: the program is wrong",
    Cause.POSITION_LIMIT_EXCEEDED: "when the session has ended and the drive has reported that "
    "its power is off, move the arm back by hand; if it was not there, the encoder jumped: "
    "`rigidimeter check`",
    Cause.MOTION_STALE: "check the drive's connection, or raise the limit if the drive answers "
    "more slowly than that",
    Cause.TORQUE_STALE: "check the sensor's connection, or raise the limit if its samples come "
    "more slowly than that",
    Cause.TORQUE_FROZEN: _CABLE,
    Cause.TORQUE_SATURATED: "lower prbs.amplitude_nm, or use a sensor with a larger range",
    Cause.TORQUE_STATUS: _CABLE,
    Cause.TORQUE_PACKETS: "connect the sensor to a network port of its own, without a switch",
    Cause.SENSOR_CHANGED: "restore the sensor's units and calibration, or commission the rig anew",
    Cause.NOT_FOLLOWING: "check for slip at the coupling and for a drive limit below the guard's; "
    "then `rigidimeter check`",
    Cause.OVERSPEED: "check the drive's tuning and what moves the joint; then `rigidimeter check`",
    Cause.TORQUE_HIGH: _PUSH,
    Cause.TORQUE_TOO_HIGH: _PUSH,
    Cause.POWER_HIGH: _PUSH,
    Cause.ENERGY_HIGH: "wait until a tremor has ceased; if the rig itself oscillates, raise "
    "controller.damping_nm_s_rad or controller.inertia_kg_m2 (`rigidimeter design`)",
    Cause.DRIVE_FAULT: _DRIVE,
    Cause.DRIVE_STATE: _DRIVE,
    Cause.DRIVE_LOST: "check the drive's power and connection, and that no other master is on its "
    "bus, then `rigidimeter check`",
    Cause.EMERGENCY_STOP: "see to the subject, release the button, and continue the session with "
    "`rigidimeter run --resume`",
    Cause.OPERATOR_HALT: "see to the subject, and continue the session with "
    "`rigidimeter run --resume`",
    Cause.DEADLINES_MISSED: _PROCESSOR,
    Cause.STALLED: _PROCESSOR,
    Cause.CONSOLE_LOST: "keep the console's window and computer awake, and close programs that "
    "keep the processors busy",
    Cause.RECORDER_LOST: "record to a local disk, and close programs that keep it busy",
    Cause.RECORD_OVERFLOW: "make room, or record to a faster local disk",
    Cause.SOFTWARE: "please report this with the session folder: the program is wrong",
    Cause.SIGNAL: "continue the session with `rigidimeter run --resume`",
    Cause.STAMP_AHEAD: "check the clock that the driver stamps with, the latency that the rig "
    "file states for this device, and the rate that the device states",
    Cause.MOVED_AT_REST: "check for a drive that does not hold, a brake, or a hand on the rig; "
    "then `rigidimeter check`",
    Cause.VELOCITY_WRONG: "check sign, unit and scale of the velocity that the drive reports: "
    "`rigidimeter commission`",
    Cause.TORQUE_SILENT: f"{_CABLE}; if the sensor is in order, the drive is faster than "
    "rig.drive_bandwidth_hz says: `rigidimeter commission` measures it",
    Cause.TORQUE_SIGN: "turn the sign of the torque sensor in the rig file, then "
    "`rigidimeter check`; if it is right, the subject pushed",
    Cause.SELDOM_FRESH: "check the sensor's connection and the rate that the rig file states",
    Cause.HELD_AT_LIMIT: "see whether the subject pushes; if not, zero the torque sensor and check "
    "its sign with `rigidimeter check`",
    Cause.TORQUE_DISAGREES: f"{_CABLE}; if the sensor is in order, gear, motor or what is mounted "
    "on the drive's side were changed: `rigidimeter commission`",
    Cause.TORQUE_WILD: f"{_CABLE}, and whether its cable runs beside the motor's",
}
"""What to do about each cause."""
