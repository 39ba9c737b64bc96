"""The last word before the wire: limits, plausibility, and a latch that keeps the first cause."""

from rigidimeter.rig.guard.agreement import (
    OLD_SHARE,
    SQUARED_S,
    SUMMED_S,
    WRONG_GAIN,
    WRONG_SHARE,
    ConsistencyLimits,
    MeansState,
    consistency_limits,
    larger_gain,
    means_step,
)
from rigidimeter.rig.guard.causes import REACTIONS, Cause, Reaction
from rigidimeter.rig.guard.consistency import (
    ConsistencyState,
    consistency_state,
    consistency_step,
)
from rigidimeter.rig.guard.contact import ContactState, contact_state, contact_step
from rigidimeter.rig.guard.drive_torque import (
    LEAST_SHARE,
    PRESLIDING_RAD,
    SETTLED_S,
    SLIPS_RAD_S,
    TIMES_SCATTER,
    WINDOW_S,
    DriveModel,
    DriveTorqueLimits,
    DriveTorqueState,
    Terms,
    allowed_nm,
    beyond,
    drive_torque_limits,
    drive_torque_state,
    drive_torque_step,
    from_drive,
    zeroed,
)
from rigidimeter.rig.guard.limits import (
    GuardLimits,
    GuardState,
    guard_limits,
    guard_state,
    released,
    within_range,
)
from rigidimeter.rig.guard.step import Limited, guard_step, why_ended
from rigidimeter.rig.guard.torque_answer import (
    AT_REST,
    FILTER_RAD_S,
    HARDLY_SHOWN,
    LONGEST_S,
    MEAN_OF_S,
    NOISE_ORDERS,
    NOTHING_YET,
    ROW_S,
    ROWS,
    ROWS_A_TEST,
    SETTLED,
    SHOWN_MEMORY_S,
    UNSHOWN_NM,
    AnswerLimits,
    answer_limits,
    answer_state,
    answer_step,
    lowpassed,
    mean_of_ticks,
)
from rigidimeter.rig.guard.torque_sign import (
    ACCELERATION,
    BEFORE,
    COLUMNS,
    DIFFERENCES,
    FALSE_ALARMS,
    IF_EARLY,
    INSTRUMENTS,
    JERK,
    LAGS,
    PASSES,
    SINGULAR,
    Left,
    difference_columns,
    explained_answer,
    fits_better,
    left_by_each_sign,
    max_left,
    sign_is_wrong,
    solved,
    solved_for,
    whitened,
    without,
)
from rigidimeter.rig.guard.watch import energy_after, found_wrong, outside
from rigidimeter.rig.guard.wild_torque import THREE_S, WildState, median, wild_step
