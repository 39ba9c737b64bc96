"""Two sets of limits, a state, and a step whose readings are those of a joint at rest."""

from rigidimeter.rig.guard import Cause, GuardLimits, guard_state, guard_step

LIMITS = GuardLimits(
    position_rad=0.7,
    speed_rad_s=3.0,
    acceleration_rad_s2=100.0,
    reaction_time_s=0.0,
    interval_s=0.001,
)
BINARY = GuardLimits(
    position_rad=64.0,
    speed_rad_s=16.0,
    acceleration_rad_s2=8.0,
    reaction_time_s=0.5,
    interval_s=0.125,
    stale_s=2.0,
    following_rad=1.0,
)
"""Numbers that are whole in base two, so that sums are exact."""


def at(velocity=0.0, limits=LIMITS, **values):
    return guard_state(limits)._replace(velocity_rad_s=velocity, **values)


def step(
    state,
    request=0.0,
    *,
    torque=0.0,
    angle=0.0,
    velocity=0.0,
    age_s=0.0,
    limits=LIMITS,
    torque_age_s=0.0,
    reported=Cause.NONE,
    elapsed=1,
    disagreement=Cause.NONE,
):
    readings = (torque, angle, velocity, age_s, torque_age_s)
    return guard_step(limits, state, request, *readings, reported, elapsed, disagreement)
