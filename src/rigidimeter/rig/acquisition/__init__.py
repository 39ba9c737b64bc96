"""The only place with time: the clock, the control loop, and the run of a session."""

from rigidimeter.rig.acquisition.clock import Clock, DeadlineClock, SimulatedClock, relative_sleep
from rigidimeter.rig.acquisition.control_modes import (
    change_parameter,
    follow,
    go_back,
    hold,
    perturb,
    ramp_to_rest,
    release,
    rest,
    return_duration_s,
    skip_passed_ticks,
)
from rigidimeter.rig.acquisition.controller_run import ControllerRun
from rigidimeter.rig.acquisition.replay import (
    Difference,
    NamedCause,
    Replay,
    replay,
    replay_session,
)
from rigidimeter.rig.acquisition.run_states import (
    NOTHING,
    Command,
    Order,
    Phase,
    Run,
    State,
    after,
    epoch_over,
)
from rigidimeter.rig.acquisition.session_run import SessionResult, run_session
from rigidimeter.rig.acquisition.stop_remedies import REMEDIES, SUSPENDED
from rigidimeter.rig.acquisition.stop_report import Found, Latched, StopReport, report_stop
from rigidimeter.rig.acquisition.supervision import NoSupervision, Supervision
from rigidimeter.rig.acquisition.tick import (
    REST,
    ControlLoop,
    latched_tick,
    run_ticks,
    set_admittance,
    zero_torque,
)
from rigidimeter.rig.acquisition.zeroing import (
    MIN_ZEROING_SAMPLES,
    angle_range_deg,
    bias_and_noise,
    motion_objection,
)
