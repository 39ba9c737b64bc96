"""The last word before the wire: limits, plausibility, and a latch that keeps the first cause."""

from rigidimeter.guard.agreement import ConsistencyLimits, consistency_limits
from rigidimeter.guard.causes import REACTIONS, Cause, Reaction
from rigidimeter.guard.consistency import (
    ConsistencyState,
    consistency_state,
    consistency_step,
)
from rigidimeter.guard.limits import GuardLimits, GuardState, guard_limits, guard_state, released
from rigidimeter.guard.step import Limited, guard_step, why_ended
from rigidimeter.guard.torque_answer import AnswerLimits, answer_limits
