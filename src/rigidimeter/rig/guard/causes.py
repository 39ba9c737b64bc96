"""Why a rig is stopped, and how: the reaction that belongs to each cause.

Devices, loop and guard name a cause by the same numbers, so that the record, the console and the
hazard table speak of the same things. The first cause is kept; a later one can make the reaction
stronger, never weaker.
"""

from __future__ import annotations

from enum import IntEnum


class Reaction(IntEnum):
    """What is done, from the weakest to the strongest.

    HOLD: the velocity is ramped to zero and held there; the operator may go on.
    RAMP: the velocity is ramped to zero, then the power is taken away; latched (category 1).
    CUT: the power is taken away at once; latched (category 0).
    """

    NONE = 0
    HOLD = 1
    RAMP = 2
    CUT = 3


class Cause(IntEnum):
    """Why the guard latched."""

    NONE = 0
    TORQUE_NOT_FINITE = 1
    MOTION_NOT_FINITE = 2
    COMMAND_NOT_FINITE = 3
    POSITION_LIMIT_EXCEEDED = 4
    MOTION_STALE = 5
    TORQUE_STALE = 6
    TORQUE_FROZEN = 7
    TORQUE_SATURATED = 8
    TORQUE_STATUS = 9
    TORQUE_PACKETS = 10
    SENSOR_CHANGED = 11
    NOT_FOLLOWING = 12
    OVERSPEED = 13
    TORQUE_HIGH = 14
    TORQUE_TOO_HIGH = 15
    POWER_HIGH = 16
    ENERGY_HIGH = 17
    DRIVE_FAULT = 18
    DRIVE_STATE = 19
    DRIVE_LOST = 20
    EMERGENCY_STOP = 21
    OPERATOR_HALT = 22
    DEADLINES_MISSED = 23
    STALLED = 24
    CONSOLE_LOST = 25
    RECORDER_LOST = 26
    RECORD_OVERFLOW = 27
    SOFTWARE = 28
    SIGNAL = 29
    STAMP_AHEAD = 30
    MOVED_AT_REST = 31
    VELOCITY_WRONG = 32
    TORQUE_SILENT = 33
    TORQUE_SIGN = 34
    SELDOM_FRESH = 35
    HELD_AT_LIMIT = 36
    TORQUE_DISAGREES = 37
    TORQUE_WILD = 38

    @property
    def sentence(self) -> str:
        """What happened, in words."""
        return _SENTENCES[self]

    @property
    def reaction(self) -> Reaction:
        """What is done about it."""
        return Reaction(REACTIONS[self])


_SENTENCES = {
    Cause.NONE: "no fault",
    Cause.TORQUE_NOT_FINITE: "the torque sensor gave a number that is not finite",
    Cause.MOTION_NOT_FINITE: "the angle or velocity reading was not finite",
    Cause.COMMAND_NOT_FINITE: "the controller asked for a velocity that is not finite",
    Cause.POSITION_LIMIT_EXCEEDED: "the angle was beyond the position limit",
    Cause.MOTION_STALE: "no new angle reading arrived in time",
    Cause.TORQUE_STALE: "no new torque reading arrived in time",
    Cause.TORQUE_FROZEN: "the torque sensor repeated the same sample",
    Cause.TORQUE_SATURATED: "the torque sensor was saturated",
    Cause.TORQUE_STATUS: "the torque sensor reported an error of its own",
    Cause.TORQUE_PACKETS: "too many packets of the torque sensor were lost, repeated or damaged",
    Cause.SENSOR_CHANGED: "the torque sensor came back with other units or another calibration",
    Cause.NOT_FOLLOWING: "the angle did not change as commanded",
    Cause.OVERSPEED: "the joint was faster than the speed limit",
    Cause.TORQUE_HIGH: "the torque was above the limit",
    Cause.TORQUE_TOO_HIGH: "the torque was far above the limit",
    Cause.POWER_HIGH: "the power into or out of the joint was above the limit",
    Cause.ENERGY_HIGH: "more energy went to and fro between rig and joint within a second than the "
    "limit allows, as in an unstable contact",
    Cause.DRIVE_FAULT: "the drive reported a fault",
    Cause.DRIVE_STATE: "the drive left the state or the mode it was put in",
    Cause.DRIVE_LOST: "the drive no longer answered, or answered what was not asked",
    Cause.EMERGENCY_STOP: "the emergency stop was pressed",
    Cause.OPERATOR_HALT: "the operator halted the rig",
    Cause.DEADLINES_MISSED: "the loop missed ticks too often in a row",
    Cause.STALLED: "the loop stood still for too long",
    Cause.CONSOLE_LOST: "the operator's console no longer answered",
    Cause.RECORDER_LOST: "the recorder no longer answered",
    Cause.RECORD_OVERFLOW: "the recorder fell too far behind",
    Cause.SOFTWARE: "the program failed",
    Cause.SIGNAL: "the program received a signal to end",
    Cause.STAMP_AHEAD: "a reading bore the time of a moment still to come",
    Cause.MOVED_AT_REST: "the joint moved while commanded to rest",
    Cause.VELOCITY_WRONG: "the velocity reading did not agree with the change of the angle",
    Cause.TORQUE_SILENT: "the joint was accelerated and the torque sensor did not show it, or the "
    "drive is faster than rig.drive_bandwidth_hz",
    Cause.TORQUE_SIGN: "the torque sensor answered the perturbation with the wrong sign",
    Cause.SELDOM_FRESH: "fresh readings came too seldom",
    Cause.HELD_AT_LIMIT: "the joint was driven against the position limit for too long or too "
    "often: the subject pushes, or the torque has an offset or the wrong sign",
    Cause.TORQUE_DISAGREES: "the torque sensor did not agree with the drive's own torque",
    Cause.TORQUE_WILD: "single torque samples were far from those before and after them",
}

_HOLD = {Cause.TORQUE_HIGH, Cause.POWER_HIGH, Cause.HELD_AT_LIMIT, Cause.TORQUE_WILD}
_CUT = {Cause.EMERGENCY_STOP, Cause.OPERATOR_HALT}

REACTIONS = tuple(
    int(
        Reaction.NONE
        if cause is Cause.NONE
        else Reaction.HOLD
        if cause in _HOLD
        else Reaction.CUT
        if cause in _CUT
        else Reaction.RAMP
    )
    for cause in Cause
)
"""The reaction to each cause, by its number: a plain table, so that compiled code can look too."""
