"""The plant and its loop: joint, drive, sensors, subject as steps, and the linear loop of them."""

from rigidimeter.dynamics.arm import Arm, arm, arm_step, arm_torque_nm
from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.dynamics.loop_motion import (
    ClosedLoopMotion,
    closed_loop_motion,
    voluntary_motion_sd,
)
from rigidimeter.dynamics.loop_poles import spectral_radius
from rigidimeter.dynamics.loop_response import LoopModel, command_response, loop_model, open_loop
from rigidimeter.dynamics.noise_density import sensor_density, subject_density
from rigidimeter.dynamics.random_streams import BLOCK_TICKS, RigStreams, rig_streams
from rigidimeter.dynamics.sensors import (
    SAME_TIME_S,
    between,
    moment,
    quantised,
    sample_time_blocks_s,
    sample_times_s,
)
from rigidimeter.dynamics.stability import (
    Margins,
    Stability,
    loop_margins,
    loop_stability,
    near_instability,
    refuse_unstable,
    subject_joint,
)
from rigidimeter.dynamics.subject_torque import SubjectTorque, draw_joint
from rigidimeter.dynamics.velocity_drive import Drive, DriveState, drive, drive_step

__all__ = [
    "BLOCK_TICKS",
    "SAME_TIME_S",
    "Arm",
    "ClosedLoopMotion",
    "Drive",
    "DriveState",
    "JointDynamics",
    "LoopModel",
    "Margins",
    "RigStreams",
    "Stability",
    "SubjectTorque",
    "arm",
    "arm_step",
    "arm_torque_nm",
    "between",
    "closed_loop_motion",
    "command_response",
    "draw_joint",
    "drive",
    "drive_step",
    "loop_margins",
    "loop_model",
    "loop_stability",
    "moment",
    "near_instability",
    "open_loop",
    "quantised",
    "refuse_unstable",
    "rig_streams",
    "sample_time_blocks_s",
    "sample_times_s",
    "sensor_density",
    "spectral_radius",
    "subject_density",
    "subject_joint",
    "voluntary_motion_sd",
]
