"""The plant of the virtual rig: arm, drive, sensors and subject."""

from rigidimeter.simulation.arm import Arm, arm, arm_step, arm_torque_nm
from rigidimeter.simulation.drive import Drive, DriveState, drive, drive_step
from rigidimeter.simulation.sensor import (
    SAME_TIME_S,
    between,
    moment,
    quantised,
    sample_time_blocks_s,
    sample_times_s,
)
from rigidimeter.simulation.streams import BLOCK_TICKS, RigStreams, rig_streams
from rigidimeter.simulation.subject import SubjectTorque, draw_joint

__all__ = [
    "BLOCK_TICKS",
    "SAME_TIME_S",
    "Arm",
    "Drive",
    "DriveState",
    "RigStreams",
    "SubjectTorque",
    "arm",
    "arm_step",
    "arm_torque_nm",
    "between",
    "draw_joint",
    "drive",
    "drive_step",
    "moment",
    "quantised",
    "rig_streams",
    "sample_time_blocks_s",
    "sample_times_s",
]
