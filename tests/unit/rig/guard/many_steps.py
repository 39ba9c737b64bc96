"""Many steps of the agreement of readings, by functions of the time."""

from rigidimeter.rig.guard import (
    Cause,
    ConsistencyLimits,
    consistency_state,
    consistency_step,
)

DT = 0.001
NOTHING = ConsistencyLimits(DT)


def run(limits, n, angle, velocity, *, sent=1.0, torque=0.0, ages=(0.0, 0.0), elapsed=1, start=0):
    """Step through functions of the time; return the first tick with a cause, it, and the state."""
    state = consistency_state(limits)

    def at(value, t):
        return value(t) if callable(value) else value

    for k in range(start, n):
        t = k * elapsed * limits.interval_s
        values = [at(value, t) for value in (sent, 0.0, torque, angle, velocity, *ages)]
        state, cause = consistency_step(limits, state, *values, elapsed)
        if cause:
            return k, Cause(cause), state
    return n, Cause.NONE, state
