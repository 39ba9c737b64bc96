"""What a stop says: the cause, the value that was found, its limit, for how long, and a remedy.

The guard names a cause and no more: what it decides at every tick stays as small as it can be. Here
the number behind the cause is taken, once, from the tick at which the guard latched and from what
the guard remembers of it. A cause that a device reports has no number here but the device's own
status word.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from rigidimeter.core.session import Sample
from rigidimeter.core.settings import Settings
from rigidimeter.core.units import deg_from_rad
from rigidimeter.rig.acquisition.stop_remedies import REMEDIES, SUSPENDED
from rigidimeter.rig.guard import (
    OLD_SHARE,
    SHOWN_MEMORY_S,
    SQUARED_S,
    SUMMED_S,
    THREE_S,
    WINDOW_S,
    WRONG_GAIN,
    WRONG_SHARE,
    Cause,
    ConsistencyLimits,
    ConsistencyState,
    DriveTorqueLimits,
    DriveTorqueState,
    GuardLimits,
    GuardState,
    allowed_nm,
    larger_gain,
    outside,
)


class Latched(NamedTuple):
    """The tick at which the guard latched.

    `late_in_a_row` counts late ticks up to this one. `torques` and `compared` are of the comparison
    with the drive's own torque. `measured` is what was found outside of the
    loop: seconds of silence or of suspension, or samples that wait; NaN where nothing was.
    """

    settings: Settings
    sample: Sample
    limits: GuardLimits
    guard: GuardState
    agreement: ConsistencyLimits
    consistency: ConsistencyState
    elapsed_ticks: int
    late_in_a_row: int
    measured: float
    torques: DriveTorqueLimits
    compared: DriveTorqueState


class Found(NamedTuple):
    """The value that broke a law, and the limit, both in `unit`; NaN where there is none.

    `setting` is where the limit is set, empty where it is not. `duration_s` is how long it lasted,
    or over how long the value was taken. `at_least` says that the limit is the smallest value
    allowed, not the largest. `device` is what a device says of it.
    """

    value: float = math.nan
    limit: float = math.nan
    unit: str = ""
    duration_s: float = math.nan
    setting: str = ""
    at_least: bool = False
    device: str = ""


class StopReport(NamedTuple):
    """What a stop or a hold says of itself."""

    cause: Cause
    found: Found
    remedy: str

    @property
    def sentence(self) -> str:
        """All of it, as the operator reads it."""
        found = self.found
        parts = [found.device] if found.device else []
        known = math.isfinite(found.value)
        if known:
            parts.append(f"{found.value:.3g} {found.unit}".strip())
        lasted_s = found.duration_s
        if known and math.isfinite(lasted_s) and found.unit not in ("ms", "s"):  # they say it
            ms = f"{1e3 * lasted_s:.3g} ms"
            parts.append(f"for {lasted_s:.3g} s" if lasted_s >= 1.0 else f"for {ms}")
        if known and math.isfinite(found.limit):
            limit = "at least" if found.at_least else "limit"
            where = f" ({found.setting})" if found.setting else ""
            parts.append(f"{limit} {found.limit:.4g} {found.unit}{where}")
        numbers = f": {', '.join(parts)}" if parts else ""
        return f"{self.cause.sentence}{numbers}; {self.remedy}"

    def facts(self) -> dict[str, Any]:
        """Return what the record says of it; what is not known is null."""
        found = self.found
        numbers = {"value": found.value, "limit": found.limit, "duration_s": found.duration_s}
        return {
            "cause": self.cause.name.lower(),
            "reaction": self.cause.reaction.name.lower(),
            **{name: value if math.isfinite(value) else None for name, value in numbers.items()},
            "unit": found.unit,
            "device": found.device,
            "setting": found.setting,
            "remedy": self.remedy,
            "sentence": self.sentence,
        }


def report_stop(latched: Latched) -> StopReport:
    """Return what a stop says, from the tick at which the guard latched."""
    cause = Cause(latched.guard.cause)
    find = _FOUND.get(cause)
    remedy = REMEDIES[cause]
    if cause is Cause.STALLED and latched.measured > latched.settings.loop.stall_s:
        remedy = SUSPENDED
    return StopReport(cause, find(latched) if find else Found(), remedy)


def _passed_s(latched: Latched) -> float:
    return latched.elapsed_ticks * latched.limits.interval_s


def _age(latched: Latched, stamp_s: float) -> Found:
    age_s = latched.sample.tick * latched.limits.interval_s - stamp_s
    return Found(1e3 * age_s, 1e3 * latched.limits.stale_s, "ms", age_s, "guard.stale_s")


def _motion_age(latched: Latched) -> Found:
    age_s, stale_s = latched.guard.age_s, latched.limits.stale_s
    if latched.guard.cause == Cause.MOTION_STALE and age_s <= stale_s:  # a reading that is repeated
        age_s = latched.consistency.same_s
    return Found(1e3 * age_s, 1e3 * stale_s, "ms", age_s, "guard.stale_s")


def _ahead(latched: Latched) -> Found:
    sample, limits = latched.sample, latched.limits
    ahead_s = max(sample.motion_time_s, sample.torque_time_s) - sample.tick * limits.interval_s
    limit_s = limits.reaction_time_s + limits.interval_s
    return Found(1e3 * ahead_s, 1e3 * limit_s, "ms", setting="guard.reaction_time_s and one tick")


def _position(latched: Latched) -> Found:
    limits, angle_rad = latched.limits, latched.guard.angle_rad
    low_rad, high_rad = limits.extent_rad
    above = angle_rad - high_rad > low_rad - angle_rad  # beyond which end
    end_rad = high_rad if above else low_rad
    setting = "guard.position_limit_deg"
    if abs(end_rad) < limits.position_rad:
        setting = "the range of motion of this person, from where the joint began,"
    return Found(
        deg_from_rad(abs(angle_rad)),
        deg_from_rad(abs(end_rad) + limits.tolerance_rad),
        "deg",
        _passed_s(latched),
        f"{setting} and what sensor noise may add",
    )


def _speed(latched: Latched) -> Found:
    value, limit = abs(latched.sample.velocity_rad_s), latched.limits.overspeed_rad_s
    setting = "1.25 times guard.speed_limit_deg_s"
    return Found(deg_from_rad(value), deg_from_rad(limit), "deg/s", _passed_s(latched), setting)


def _torque(latched: Latched) -> Found:
    value, limit = abs(latched.sample.torque_nm), latched.limits.torque_nm
    return Found(value, limit, "N·m", _passed_s(latched), "guard.torque_limit_nm")


def _torque_stop(latched: Latched) -> Found:
    value, limit = abs(latched.sample.torque_nm), latched.limits.torque_stop_nm
    return Found(value, limit, "N·m", _passed_s(latched), "guard.torque_stop_nm")


def _saturated(latched: Latched) -> Found:
    return _sensor(latched)._replace(value=abs(latched.sample.torque_nm), unit="N·m")


def _sensor(latched: Latched) -> Found:
    return Found(device=_word(latched.sample.torque_status))


def _drive(latched: Latched) -> Found:
    return Found(device=_word(latched.sample.motion_status))


def _word(status: int) -> str:
    return f"status word {status:#x}" if status else ""


def _power(latched: Latched) -> Found:
    value = abs(latched.sample.torque_nm * latched.sample.velocity_rad_s)
    return Found(value, latched.limits.power_w, "W", _passed_s(latched), "guard.power_limit_w")


def _energy(latched: Latched) -> Found:
    value = max(latched.guard.energy_j, latched.consistency.means.energy_j)
    return Found(value, latched.limits.energy_j, "J", 1.0, "guard.energy_limit_j")


def _following(latched: Latched) -> Found:
    limits, state = latched.limits, latched.guard
    oldest, per_s = state.sent_rad.size - 1, 1.0 / limits.interval_s
    first_s = max(state.age_s - limits.reaction_time_s, 0.0)
    last_s = max(state.age_s, 0.0) + limits.reaction_time_s
    first, last = int(min(first_s * per_s, oldest)), math.ceil(min(last_s * per_s, oldest))
    # As the guard counts it. The origin has followed the joint by one tick's drift since.
    moved_rad = state.angle_rad - state.origin_rad
    value_deg = deg_from_rad(abs(outside(state.sent_rad, state.newest, first, last, moved_rad)))
    limit_deg = deg_from_rad(limits.following_rad)
    setting = "guard.following_limit_deg and what the drive may overshoot"
    return Found(value_deg, limit_deg, "deg", setting=setting)


def _moved(latched: Latched) -> Found:
    value_rad = abs(latched.sample.angle_rad - latched.consistency.held_rad)
    return Found(
        deg_from_rad(value_rad),
        deg_from_rad(latched.agreement.hold_rad),
        "deg",
        latched.consistency.still_s,
        "guard.hold_limit_deg",
    )


def _velocity(latched: Latched) -> Found:
    means = latched.consistency.means
    both_rad2 = means.moved_rad2 + means.reported_rad2
    limit_rad = max(latched.agreement.unseen_rad, math.sqrt(WRONG_SHARE * both_rad2))
    gain = larger_gain(means)
    if means.disagreement_rad2 <= limit_rad * limit_rad and gain > WRONG_GAIN:
        larger = means.reported_rad2 > means.moved_rad2
        of = "times the change of the angle" if larger else "times the velocity"
        return Found(gain, WRONG_GAIN, of, SQUARED_S)
    value_rad = math.sqrt(means.disagreement_rad2)
    return Found(deg_from_rad(value_rad), deg_from_rad(limit_rad), "deg", SUMMED_S)


def _silent(latched: Latched) -> Found:
    answer, limits = latched.consistency.means.answer, latched.agreement.answer
    needed_nm = limits.min_part * limits.inertia_kg_m2 * math.sqrt(answer.moved2)
    setting, shown_nm = "guard.min_inertia_kg_m2", math.sqrt(answer.shown_nm2)
    return Found(shown_nm, needed_nm, "N·m", SHOWN_MEMORY_S, setting, at_least=True)


def _apart(latched: Latched) -> Found:
    steps, model = latched.compared.steps, latched.torques.model
    silent_s = latched.compared.ticks * latched.torques.interval_s
    if silent_s > WINDOW_S:
        return Found(silent_s, WINDOW_S, "s without the drive's torque")
    slope_nm = abs(steps.slope_nm2) / math.sqrt(steps.model_nm2) if steps.model_nm2 > 0.0 else 0.0
    value_nm = max(steps.size_nm, slope_nm)
    return Found(value_nm, allowed_nm(model, steps.own_nm2), "N·m", WINDOW_S)


def _wild(latched: Latched) -> Found:
    return Found(3.0, 2.0, f"samples within {THREE_S:g} s")


def _seldom(latched: Latched) -> Found:
    means = latched.consistency.means
    share = max(means.torque_old, means.motion_old)
    return Found(100.0 * share, 100.0 * OLD_SHARE, "%", latched.agreement.old_memory_s)


def _held_at_limit(latched: Latched) -> Found:
    limits, contact = latched.limits, latched.guard.contact
    if contact.three_s <= limits.arrivals_s:
        return Found(3.0, 2.0, f"arrivals within {limits.arrivals_s:g} s", contact.three_s)
    # It is added up tick by tick and was above the limit for the first time; the guard's own count
    # has gone on, as a joint that is held is not driven against the limit.
    held_s = limits.at_limit_s + _passed_s(latched)
    return Found(held_s, limits.at_limit_s, f"s of the last {limits.at_limit_of_s:g} s")


def _missed(latched: Latched) -> Found:
    count, limit = latched.late_in_a_row, latched.settings.loop.missed_in_a_row
    lasted_s = count * latched.limits.interval_s
    return Found(count, limit, "ticks in a row", lasted_s, "loop.missed_in_a_row")


def _stalled(latched: Latched) -> Found:
    limit_s = latched.settings.loop.stall_s
    stood_s = latched.sample.lateness_s
    if math.isfinite(latched.measured):  # its own clock knows nothing of a suspension
        stood_s = max(stood_s, latched.measured)
    return Found(1e3 * stood_s, 1e3 * limit_s, "ms", stood_s, "loop.stall_s")


def _console(latched: Latched) -> Found:
    silent_s, limit_s = latched.measured, latched.settings.loop.console_lost_s
    return Found(silent_s, limit_s, "s", silent_s, "loop.console_lost_s")


def _recorder(latched: Latched) -> Found:
    silent_s, limit_s = latched.measured, latched.settings.loop.recorder_lost_s
    return Found(silent_s, limit_s, "s", silent_s, "loop.recorder_lost_s")


def _overflow(latched: Latched) -> Found:
    waits_s, limit_s = latched.measured * latched.limits.interval_s, _recorder(latched).limit
    return Found(waits_s, limit_s, "s of samples", setting="loop.recorder_lost_s")


_FOUND: dict[Cause, Callable[[Latched], Found]] = {
    Cause.POSITION_LIMIT_EXCEEDED: _position,
    Cause.MOTION_STALE: _motion_age,
    Cause.DRIVE_LOST: _motion_age,
    Cause.TORQUE_STALE: lambda latched: _age(latched, latched.sample.torque_time_s),
    Cause.STAMP_AHEAD: _ahead,
    Cause.OVERSPEED: _speed,
    Cause.TORQUE_STATUS: _sensor,
    Cause.DRIVE_FAULT: _drive,
    Cause.DRIVE_STATE: _drive,
    Cause.NOT_FOLLOWING: _following,
    Cause.TORQUE_SATURATED: _saturated,
    Cause.TORQUE_HIGH: _torque,
    Cause.TORQUE_TOO_HIGH: _torque_stop,
    Cause.POWER_HIGH: _power,
    Cause.ENERGY_HIGH: _energy,
    Cause.HELD_AT_LIMIT: _held_at_limit,
    Cause.MOVED_AT_REST: _moved,
    Cause.VELOCITY_WRONG: _velocity,
    Cause.TORQUE_SILENT: _silent,
    Cause.TORQUE_DISAGREES: _apart,
    Cause.TORQUE_WILD: _wild,
    Cause.SELDOM_FRESH: _seldom,
    Cause.DEADLINES_MISSED: _missed,
    Cause.STALLED: _stalled,
    Cause.CONSOLE_LOST: _console,
    Cause.RECORDER_LOST: _recorder,
    Cause.RECORD_OVERFLOW: _overflow,
}
