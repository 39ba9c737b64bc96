"""The plant of the virtual rig: arm, drive, sensors and subject."""

from rigidimeter.simulation.arm import Arm, arm, arm_step, arm_torque_nm
from rigidimeter.simulation.drive import Drive, DriveState, drive, drive_step
from rigidimeter.simulation.sensor import quantised, sample_times_s
from rigidimeter.simulation.subject import SubjectTorque, draw_joint

__all__ = [
    "Arm",
    "Drive",
    "DriveState",
    "SubjectTorque",
    "arm",
    "arm_step",
    "arm_torque_nm",
    "draw_joint",
    "drive",
    "drive_step",
    "quantised",
    "sample_times_s",
]
