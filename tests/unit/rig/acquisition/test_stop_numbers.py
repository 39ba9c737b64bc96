"""The number, the limit and the time that each cause is told with, one tick put together by hand.

All values differ in size and sign, so that none stands for another.
"""

import math

import numpy as np
import pytest
from tests.unit.rig.acquisition.exact_rig import INTERVAL_S, made

from rigidimeter.core.session import Sample
from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.acquisition import (
    REMEDIES,
    SUSPENDED,
    Found,
    Latched,
    StopReport,
    latched_tick,
    report_stop,
)
from rigidimeter.rig.guard import (
    OLD_SHARE,
    SHOWN_MEMORY_S,
    SQUARED_S,
    SUMMED_S,
    WRONG_GAIN,
    WRONG_SHARE,
    Cause,
    DriveModel,
)

SETTINGS = parse_settings({"loop": {"missed_in_a_row": 4}})
GUARD, LOOP = SETTINGS.guard, SETTINGS.loop
TICK, ELAPSED = 2000, 3
PASSED_S = ELAPSED * INTERVAL_S
TIME_S = TICK * INTERVAL_S


def latched(cause, **changed):
    """Return the tick at which the guard latched; `changed` by the part and the field."""
    loop, _ = made(SETTINGS)
    sample = Sample(
        tick=TICK,
        time_s=2.05,
        lateness_s=0.033,
        epoch=1,
        perturbation_nm=0.6,
        torque_nm=-3.0,
        torque_time_s=1.93,
        angle_rad=-0.7,
        velocity_rad_s=-5.0,
        motion_time_s=1.98,
        target_angle_rad=0.1,
        velocity_request_rad_s=0.2,
        velocity_command_rad_s=0.3,
        limited=4,
        torque_status=0x40,
        motion_status=0x8,
    )
    means = loop.consistency.means
    answer = means.answer._replace(shown_nm2=0.0004, moved2=25.0)
    means = means._replace(
        answer=answer,
        disagreement_rad2=0.0009,
        moved_rad2=0.005,
        reported_rad2=0.005,
        energy_j=0.7,
        torque_old=0.3,
        motion_old=0.2,
    )
    steps = loop.compared.steps._replace(
        size_nm=0.3, slope_nm2=-0.2, model_nm2=0.25, own_nm2=4.0, settled_s=2.0
    )
    found = Latched(
        SETTINGS,
        sample,
        loop.limits,
        loop.guard._replace(cause=int(cause), angle_rad=-0.8, age_s=0.12, energy_j=0.4),
        loop.agreement,
        loop.consistency._replace(means=means, still_s=1.7, held_rad=-0.1),
        ELAPSED,
        7,
        math.nan,
        loop.torques._replace(model=DriveModel(scatter_nm=0.05, scatter_share=0.01)),
        loop.compared._replace(steps=steps),
    )
    for part, fields in changed.items():
        if isinstance(fields, dict):
            fields = getattr(found, part)._replace(**fields)
        found = found._replace(**{part: fields})
    return found


def told(cause, **changed):
    return report_stop(latched(cause, **changed)).found


def same(found, expected):
    """Hold all fields equal, numbers to 1e-9 of their size."""
    for name, value, wanted in zip(Found._fields, found, expected, strict=True):
        if isinstance(wanted, float):
            assert value == pytest.approx(wanted, rel=1e-9, nan_ok=True), name
        else:
            assert value == wanted, name


LIMITS = made(SETTINGS)[0].limits
AGREEMENT = made(SETTINGS)[0].agreement
STALE = (1e3 * GUARD.stale_s, "ms")


@pytest.mark.parametrize(
    ("cause", "expected"),
    [
        (
            Cause.POSITION_LIMIT_EXCEEDED,
            Found(
                math.degrees(0.8),
                math.degrees(LIMITS.position_rad + LIMITS.tolerance_rad),
                "deg",
                PASSED_S,
                "guard.position_limit_deg and what sensor noise may add",
            ),
        ),
        (Cause.MOTION_STALE, Found(120.0, *STALE, 0.12, "guard.stale_s")),
        (Cause.DRIVE_LOST, Found(120.0, *STALE, 0.12, "guard.stale_s")),
        (Cause.TORQUE_STALE, Found(70.0, *STALE, 0.07, "guard.stale_s")),
        (
            Cause.OVERSPEED,
            Found(
                math.degrees(5.0),
                math.degrees(LIMITS.overspeed_rad_s),
                "deg/s",
                PASSED_S,
                "1.25 times guard.speed_limit_deg_s",
            ),
        ),
        (Cause.TORQUE_STATUS, Found(device="status word 0x40")),
        (Cause.TORQUE_SATURATED, Found(3.0, unit="N·m", device="status word 0x40")),
        (Cause.DRIVE_FAULT, Found(device="status word 0x8")),
        (Cause.DRIVE_STATE, Found(device="status word 0x8")),
        (
            Cause.TORQUE_HIGH,
            Found(3.0, GUARD.torque_limit_nm, "N·m", PASSED_S, "guard.torque_limit_nm"),
        ),
        (
            Cause.TORQUE_TOO_HIGH,
            Found(3.0, GUARD.torque_stop_nm, "N·m", PASSED_S, "guard.torque_stop_nm"),
        ),
        (
            Cause.POWER_HIGH,
            Found(15.0, GUARD.power_limit_w, "W", PASSED_S, "guard.power_limit_w"),
        ),
        (Cause.ENERGY_HIGH, Found(0.7, GUARD.energy_limit_j, "J", 1.0, "guard.energy_limit_j")),
        (
            Cause.HELD_AT_LIMIT,
            Found(LIMITS.at_limit_s + PASSED_S, LIMITS.at_limit_s, "s of the last 5 s"),
        ),
        (
            Cause.MOVED_AT_REST,
            Found(
                math.degrees(0.6),
                math.degrees(AGREEMENT.hold_rad),
                "deg",
                1.7,
                "guard.hold_limit_deg",
            ),
        ),
        (
            Cause.VELOCITY_WRONG,
            Found(math.degrees(0.03), math.degrees(0.1 * math.sqrt(WRONG_SHARE)), "deg", SUMMED_S),
        ),
        (
            Cause.TORQUE_SILENT,
            Found(
                0.02,
                5.0 * AGREEMENT.answer.min_part * GUARD.min_inertia_kg_m2,
                "N·m",
                SHOWN_MEMORY_S,
                "guard.min_inertia_kg_m2",
                at_least=True,
            ),
        ),
        # The slope: 0.2/0.5 N·m is more than the size; 4 (0.05 + 0.01 · 2 N·m) are allowed.
        (Cause.TORQUE_DISAGREES, Found(0.4, 0.28, "N·m", 0.5)),
        (Cause.SELDOM_FRESH, Found(30.0, 100.0 * OLD_SHARE, "%", AGREEMENT.old_memory_s)),
        (
            Cause.DEADLINES_MISSED,
            Found(7.0, 4.0, "ticks in a row", 0.007, "loop.missed_in_a_row"),
        ),
        (Cause.STALLED, Found(33.0, 1e3 * LOOP.stall_s, "ms", 0.033, "loop.stall_s")),
        (Cause.TORQUE_FROZEN, Found()),
        (Cause.SIGNAL, Found()),
    ],
    ids=lambda value: value.name if isinstance(value, Cause) else "",
)
def test_each_cause_is_told_with_its_number(cause, expected):
    same(told(cause), expected)


@pytest.mark.parametrize(
    ("cause", "changed", "field", "expected"),
    [
        (Cause.ENERGY_HIGH, {"guard": {"energy_j": 0.9}}, "value", 0.9),
        (Cause.OVERSPEED, {"sample": {"velocity_rad_s": 6.0}}, "value", math.degrees(6.0)),
        (Cause.POWER_HIGH, {"sample": {"velocity_rad_s": 6.0}}, "value", 18.0),
        (Cause.TORQUE_STATUS, {"sample": {"torque_status": 0}}, "device", ""),
        (Cause.STALLED, {"measured": 0.02}, "value", 33.0),
        (Cause.STALLED, {"measured": 12.5}, "value", 12500.0),
        (Cause.STAMP_AHEAD, {"sample": {"motion_time_s": 2.05}}, "value", 50.0),
        (Cause.STAMP_AHEAD, {"sample": {"torque_time_s": 2.04}}, "value", 40.0),
    ],
)
def test_the_larger_of_two_is_told(cause, changed, field, expected):
    assert getattr(told(cause, **changed), field) == pytest.approx(expected)


def test_wild_samples_are_told_with_the_time_of_three():
    same(told(Cause.TORQUE_WILD), Found(3.0, 2.0, "samples within 1 s"))


def test_the_third_arrival_is_told_with_the_time_that_three_took():
    guard = made(SETTINGS)[0].guard
    contact = guard.contact._replace(three_s=6.5)
    found = told(Cause.HELD_AT_LIMIT, guard={"contact": contact})
    same(found, Found(3.0, 2.0, "arrivals within 10 s", 6.5))
    contact = contact._replace(three_s=10.5)
    assert told(Cause.HELD_AT_LIMIT, guard={"contact": contact}).unit == "s of the last 5 s"


@pytest.mark.parametrize(("angle_rad", "end_rad"), [(-0.8, 0.2), (0.8, 0.4), (0.3, 0.4)])
def test_of_a_range_the_end_that_was_passed_is_told(angle_rad, end_rad):
    limits = {"lowest_rad": -0.2, "highest_rad": 0.4}
    found = told(Cause.POSITION_LIMIT_EXCEEDED, guard={"angle_rad": angle_rad}, limits=limits)
    assert found.value == pytest.approx(math.degrees(abs(angle_rad)))
    assert found.limit == pytest.approx(math.degrees(end_rad + LIMITS.tolerance_rad))
    assert found.setting == (
        "the range of motion of this person, from where the joint began, and what sensor noise "
        "may add"
    )


def test_a_stamp_ahead_may_be_so_by_the_reaction_time_and_a_tick():
    found = told(Cause.STAMP_AHEAD)
    most_ms = 1e3 * (GUARD.reaction_time_s + INTERVAL_S)
    assert (found.limit, found.unit) == (pytest.approx(most_ms), "ms")
    assert math.isnan(found.duration_s)
    assert found.setting == "guard.reaction_time_s and one tick"


def test_other_means_are_told_where_they_are_the_larger_ones():
    consistency = latched(Cause.VELOCITY_WRONG).consistency
    means = consistency.means._replace(moved_rad2=5e-13, reported_rad2=5e-13, motion_old=0.4)
    limit = told(Cause.VELOCITY_WRONG, consistency={"means": means}).limit
    assert limit == pytest.approx(math.degrees(AGREEMENT.unseen_rad))
    assert told(Cause.SELDOM_FRESH, consistency={"means": means}).value == pytest.approx(40.0)


@pytest.mark.parametrize(
    ("moved_rad2", "reported_rad2", "unit"),
    [
        (0.005, 0.02, "times the change of the angle"),
        (0.02, 0.005, "times the velocity"),
    ],
)
def test_a_velocity_of_another_size_is_told_by_how_much(moved_rad2, reported_rad2, unit):
    consistency = latched(Cause.VELOCITY_WRONG).consistency
    means = consistency.means._replace(
        moved_rad2=moved_rad2, reported_rad2=reported_rad2, disagreement_rad2=0.005
    )
    found = told(Cause.VELOCITY_WRONG, consistency={"means": means})
    assert (found.value, found.limit) == (pytest.approx(2.0), WRONG_GAIN)
    assert (found.unit, found.duration_s) == (unit, SQUARED_S)


def test_of_two_laws_the_one_that_is_broken_is_told():
    """A value at its limit, to the bit, breaks no law. Gain: (m + r - d) / 2 on the smaller."""
    consistency = latched(Cause.VELOCITY_WRONG).consistency

    def velocity(**values):
        means = consistency.means._replace(**values)
        return told(Cause.VELOCITY_WRONG, consistency={"means": means})

    smaller, unseen_rad2 = 2.0**-6, AGREEMENT.unseen_rad * AGREEMENT.unseen_rad
    gain = velocity(moved_rad2=smaller, reported_rad2=3 * smaller, disagreement_rad2=smaller)
    assert gain.unit == "deg"  # the gain is WRONG_GAIN
    assert gain.value == pytest.approx(math.degrees(2.0**-3))
    few = {"moved_rad2": 0.1 * unseen_rad2, "reported_rad2": 1.5 * unseen_rad2}
    apart = velocity(**few, disagreement_rad2=unseen_rad2)
    assert (apart.value, apart.limit) == (pytest.approx(3.0), WRONG_GAIN)


@pytest.mark.parametrize(
    ("cause", "age_s", "told_s"),
    [
        (Cause.MOTION_STALE, LIMITS.stale_s, 0.7),  # not too old: it repeats itself
        (Cause.MOTION_STALE, 1.01 * LIMITS.stale_s, 1.01 * LIMITS.stale_s),
        (Cause.DRIVE_LOST, 0.5 * LIMITS.stale_s, 0.5 * LIMITS.stale_s),
    ],
)
def test_a_reading_that_repeats_itself_is_told_by_how_long_it_did(cause, age_s, told_s):
    found = told(cause, guard={"age_s": age_s}, consistency={"same_s": 0.7})
    same(found, Found(1e3 * told_s, *STALE, told_s, "guard.stale_s"))


@pytest.mark.parametrize(
    ("cause", "expected"),
    [
        (Cause.CONSOLE_LOST, Found(6.0, LOOP.console_lost_s, "s", 6.0, "loop.console_lost_s")),
        (Cause.RECORDER_LOST, Found(6.0, LOOP.recorder_lost_s, "s", 6.0, "loop.recorder_lost_s")),
        (
            Cause.RECORD_OVERFLOW,
            Found(0.006, LOOP.recorder_lost_s, "s of samples", setting="loop.recorder_lost_s"),
        ),
    ],
)
def test_what_was_found_outside_of_the_loop(cause, expected):
    same(told(cause, measured=6.0), expected)


@pytest.mark.parametrize(
    ("measured", "remedy"),
    [
        (math.nan, REMEDIES[Cause.STALLED]),
        (LOOP.stall_s, REMEDIES[Cause.STALLED]),
        (1.01 * LOOP.stall_s, SUSPENDED),
    ],
)
def test_a_suspension_has_a_remedy_of_its_own(measured, remedy):
    assert report_stop(latched(Cause.STALLED, measured=measured)).remedy == remedy
    silent = report_stop(latched(Cause.CONSOLE_LOST, measured=measured))
    assert silent.remedy == REMEDIES[Cause.CONSOLE_LOST]


def astray_deg(moved_rad, age_s):
    """Return what is told of an angle, sums of 1 mrad more a tick, 1 rad now, being sent."""
    guard = latched(Cause.NOT_FOLLOWING).guard
    size = guard.sent_rad.size
    newest = 5  # of a ring: the ticks before are at its end
    sent = 1.0 - 0.001 * ((newest - np.arange(size)) % size)
    changed = {
        "sent_rad": sent,
        "newest": newest,
        "age_s": age_s,
        "angle_rad": 0.25 + moved_rad,
        "origin_rad": 0.25,
    }
    return told(Cause.NOT_FOLLOWING, guard=changed)


RING = made(SETTINGS)[0].guard.sent_rad.size
REACTION_TICKS = GUARD.reaction_time_s / INTERVAL_S


@pytest.mark.parametrize("age_ticks", [-10.5, 0.0, 5.5, 60.5, 1e6])
def test_how_far_the_angle_is_from_what_was_sent(age_ticks):
    """From `age - reaction` to `age + reaction` ago the sums fall by 1 mrad a tick."""
    oldest = RING - 1
    first = math.floor(min(max(age_ticks - REACTION_TICKS, 0.0), oldest))
    last = math.ceil(min(max(age_ticks, 0.0) + REACTION_TICKS, oldest))
    above = astray_deg(1.5, age_ticks * INTERVAL_S)
    assert above.value == pytest.approx(math.degrees(0.5 + 0.001 * first), abs=1e-9)
    below = astray_deg(0.1, age_ticks * INTERVAL_S)
    assert below.value == pytest.approx(math.degrees(0.9 - 0.001 * last), abs=1e-9)
    assert above.limit == pytest.approx(math.degrees(LIMITS.following_rad))
    assert (above.unit, math.isnan(above.duration_s)) == ("deg", True)
    assert above.setting == "guard.following_limit_deg and what the drive may overshoot"


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (Found(), ""),
        (Found(limit=3.0, unit="s", duration_s=2.0), ""),
        (Found(1.5, unit="s"), ": 1.5 s"),
        (Found(1.5), ": 1.5"),
        (Found(0.25, 0.1, "J", 1.0, "a.b"), ": 0.25 J, for 1 s, limit 0.1 J (a.b)"),
        (Found(0.25, 0.1, "J", 0.9994), ": 0.25 J, for 999 ms, limit 0.1 J"),
        (Found(250.0, 100.0, "ms", 0.25), ": 250 ms, limit 100 ms"),
        (Found(2.5, 1.0, "s", 2.5), ": 2.5 s, limit 1 s"),
        (Found(0.1, 0.2, "N·m", at_least=True), ": 0.1 N·m, at least 0.2 N·m"),
        (Found(device="status word 0x8"), ": status word 0x8"),
        (Found(9.9, unit="N·m", device="word"), ": word, 9.9 N·m"),
    ],
)
def test_a_sentence_tells_what_is_known(found, said):
    account = StopReport(Cause.ENERGY_HIGH, found, "do this")
    assert account.sentence == f"{Cause.ENERGY_HIGH.sentence}{said}; do this"
    facts = account.facts()
    assert facts["sentence"] == account.sentence
    assert (facts["cause"], facts["reaction"], facts["remedy"]) == (
        "energy_high",
        "ramp",
        "do this",
    )
    numbers = (found.value, found.limit, found.duration_s)
    expected = [number if math.isfinite(number) else None for number in numbers]
    assert [facts["value"], facts["limit"], facts["duration_s"]] == expected
    assert (facts["unit"], facts["device"], facts["setting"]) == (
        found.unit,
        found.device,
        found.setting,
    )


def test_what_the_loop_knows_of_its_last_tick_is_taken():
    loop, _ = made(SETTINGS)
    loop.elapsed_ticks, loop.late_in_a_row = 3, 2
    loop.supervision.measured = 0.7
    sample = latched(Cause.SIGNAL).sample
    found = latched_tick(loop, sample)
    assert found.sample is sample
    assert (found.settings, found.limits, found.guard) == (SETTINGS, loop.limits, loop.guard)
    assert (found.agreement, found.consistency) == (loop.agreement, loop.consistency)
    assert (found.elapsed_ticks, found.late_in_a_row, found.measured) == (3, 2, 0.7)
