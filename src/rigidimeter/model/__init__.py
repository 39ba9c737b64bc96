"""The plant, the controller and their loop: steps of time, and the linear loop of them."""

from rigidimeter.model.controller import (
    Admittance,
    Biquad,
    BiquadState,
    admittance,
    admittance_step,
    biquad_step,
    butterworth_lowpass,
    minimum_jerk,
    tracking_step,
)
from rigidimeter.model.drive_model import (
    ON_EDGE,
    ArmMotion,
    DriveModel,
    HeldCommand,
    lowpass,
    same_time,
    state_at_ticks,
    state_later,
    with_conjugates,
)
from rigidimeter.model.drive_side import (
    DriveSide,
    DriveSideState,
    drive_side,
    drive_side_step,
    reported_torque_nm,
)
from rigidimeter.model.emg_envelope import (
    EMG_BAND_HZ,
    ENVELOPE_RATE_HZ,
    LiveEnvelope,
    emg_band_hz,
    emg_filters,
    envelope_step,
)
from rigidimeter.model.joint import (
    JointDynamics,
    arm_response,
    arm_torque_nm,
    median_joint,
)
from rigidimeter.model.linear_loop import (
    ClosedLoopMotion,
    Loop,
    OpenLoop,
    Parameters,
    closed_loop_motion,
    on_circle,
    reading_pattern,
    voluntary_motion_sd,
)
from rigidimeter.model.loop_poles import spectral_radius
from rigidimeter.model.muscle_activity import VirtualEmg, VirtualMuscles
from rigidimeter.model.recursion import (
    STATE_SIZE,
    online_design,
    online_reading,
    online_step,
    online_torque,
)
from rigidimeter.model.sensors import (
    SAME_TIME_S,
    between,
    moment,
    quantised,
    sample_time_blocks_s,
    sample_times_s,
    sensor_density,
)
from rigidimeter.model.stability import (
    Margins,
    Stability,
    loop_margins,
    loop_stability,
    near_instability,
    refuse_unstable,
)
from rigidimeter.model.subject_torque import (
    BLOCK_TICKS,
    SubjectTorque,
    draw_joint,
    one_by_one,
    rig_streams,
    subject_density,
)
from rigidimeter.model.velocity_drive import (
    Array,
    Complex,
    Drive,
    DriveState,
    drive,
    drive_coefficients,
    drive_matrices,
    drive_step,
)
