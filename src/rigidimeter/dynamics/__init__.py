"""The plant and its loop: joint, drive, sensors, subject as steps, and the linear loop of them."""

from rigidimeter.dynamics.drive_model import (
    EVEN,
    ArmMotion,
    DriveModel,
    HeldCommand,
    lowpass,
    with_conjugates,
)
from rigidimeter.dynamics.joint import (
    JointDynamics,
    arm_response,
    arm_torque_nm,
    median_joint,
)
from rigidimeter.dynamics.linear_loop import (
    ClosedLoopMotion,
    Loop,
    OpenLoop,
    closed_loop_motion,
    voluntary_motion_sd,
)
from rigidimeter.dynamics.loop_poles import spectral_radius
from rigidimeter.dynamics.sensors import (
    SAME_TIME_S,
    between,
    moment,
    quantised,
    sample_time_blocks_s,
    sample_times_s,
    sensor_density,
)
from rigidimeter.dynamics.stability import (
    Margins,
    Stability,
    loop_margins,
    loop_stability,
    near_instability,
    refuse_unstable,
)
from rigidimeter.dynamics.subject_torque import (
    BLOCK_TICKS,
    SubjectTorque,
    draw_joint,
    rig_streams,
    subject_density,
)
from rigidimeter.dynamics.velocity_drive import (
    Drive,
    DriveState,
    drive,
    drive_step,
)
