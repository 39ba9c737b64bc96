"""What a stop says: the value that was found is the one that was injected."""

import json
import math
import re

import pytest
from tests.unit.rig.acquisition.exact_rig import SETTINGS, Desk, constant, made

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.acquisition import REMEDIES, Found, StopReport, release, run_ticks
from rigidimeter.rig.guard import Cause, Reaction

RELEASED = 5
"""The tick from which on a reading is changed."""


def stopped(change=None, *, late=None, desk=None, values=None, speed_rad_s=0.0, **options):
    """Run until the guard latches; return what it says."""
    settings = parse_settings({**(values or {})}) if values else SETTINGS
    changed = (lambda tick, r: change(r) if tick >= RELEASED else r) if change else None
    options |= {"change": changed} if changed else {}
    heard = []
    loop, _ = made(
        settings, late=late, desk=desk, latched=lambda stop, _: heard.append(stop), **options
    )
    run_ticks(loop, 1, 2000, constant(speed_rad_s))
    assert heard == [loop.stop]
    assert json.dumps(loop.stop.facts(), allow_nan=False)
    return loop.stop


def outside(cause, measured=math.nan):
    desk = Desk({10: cause})
    desk.measured = measured
    return desk


@pytest.mark.parametrize("cause", list(Cause))
def test_every_cause_has_a_remedy_and_a_sentence(cause):
    account = StopReport(cause, Found(), REMEDIES[cause])
    assert account.sentence == f"{cause.sentence}; {REMEDIES[cause]}"
    assert REMEDIES[cause][0].islower()
    assert not REMEDIES[cause].endswith(".")
    facts = account.facts()
    assert (facts["value"], facts["limit"], facts["duration_s"]) == (None, None, None)


def test_a_motion_that_repeats_itself_is_stale_since_its_first_repetition():
    kept = {"angle_rad": 0.001, "velocity_rad_s": 0.1}
    stop = stopped(lambda r: r._replace(**kept), speed_rad_s=0.1)
    assert stop.cause is Cause.MOTION_STALE
    assert "ms, limit 100 ms (guard.stale_s)" in stop.sentence
    assert stop.found.value == pytest.approx(101.0, abs=1.1)


def test_the_settings_that_are_named_exist():
    named = " ".join([*REMEDIES.values(), *settings_named()])
    for table, key in re.findall(r"(guard|loop|rig|prbs|controller)\.(\w+)", named):
        assert key in type(getattr(SETTINGS, table)).model_fields


def settings_named():
    return [
        stopped(late={9: 0.05}).found.setting,
        stopped(lambda r: r._replace(torque_nm=-12.0)).found.setting,
        stopped(desk=outside(Cause.CONSOLE_LOST, 0.6)).found.setting,
    ]


def test_a_loop_that_stood_still():
    account = stopped(late={10: 0.041}, values={"loop": {"stall_s": 0.03}})
    assert account.sentence == (
        "the loop stood still for too long: 41 ms, limit 30 ms (loop.stall_s); run it on a "
        "processor of its own with `--cpu N`, close other programs, or lower rig.tick_rate_hz"
    )
    assert account.facts()["duration_s"] == pytest.approx(0.041)


def test_a_computer_that_was_suspended():
    account = stopped(desk=outside(Cause.STALLED, 12.5))
    assert account.found.value == pytest.approx(12500.0)
    assert "suspended" in account.remedy


def test_deadlines_missed_in_a_row():
    late = {0: 0.001, 2: 0.001, 4: 0.001}
    account = stopped(late=late, values={"loop": {"missed_in_a_row": 3}})
    assert account.sentence.startswith(
        "the loop missed ticks too often in a row: 3 ticks in a row, for 3 ms, "
        "limit 3 ticks in a row (loop.missed_in_a_row)"
    )


@pytest.mark.parametrize(
    ("cause", "measured", "said"),
    [
        (Cause.CONSOLE_LOST, 0.62, "0.62 s, limit 0.5 s (loop.console_lost_s)"),
        (Cause.RECORDER_LOST, 2.1, "2.1 s, limit 2 s (loop.recorder_lost_s)"),
        (Cause.RECORD_OVERFLOW, 2300.0, "2.3 s of samples, limit 2 s of samples"),
    ],
)
def test_a_process_that_is_silent(cause, measured, said):
    assert stopped(desk=outside(cause, measured)).sentence.startswith(f"{cause.sentence}: {said}")


@pytest.mark.parametrize(
    ("change", "cause", "said"),
    [
        (
            lambda r: r._replace(torque_nm=-12.0),
            Cause.TORQUE_HIGH,
            "12 N·m, for 1 ms, limit 10 N·m (guard.torque_limit_nm)",
        ),
        (
            lambda r: r._replace(torque_nm=25.0),
            Cause.TORQUE_TOO_HIGH,
            "25 N·m, for 1 ms, limit 20 N·m (guard.torque_stop_nm)",
        ),
        (
            lambda r: r._replace(angle_rad=math.radians(-45.0)),
            Cause.POSITION_LIMIT_EXCEEDED,
            "45 deg, for 1 ms, limit 40.57 deg",
        ),
        (
            lambda r: r._replace(velocity_rad_s=math.radians(300.0)),
            Cause.OVERSPEED,
            "300 deg/s, for 1 ms, limit 250 deg/s (1.25 times guard.speed_limit_deg_s)",
        ),
        (
            lambda r: r._replace(torque_nm=8.0, velocity_rad_s=3.0),
            Cause.POWER_HIGH,
            "24 W, for 1 ms, limit 20 W (guard.power_limit_w)",
        ),
        (
            lambda r: r._replace(torque_time_s=RELEASED * 1e-3),
            Cause.TORQUE_STALE,
            "101 ms, limit 100 ms (guard.stale_s)",
        ),
        (
            lambda r: r._replace(motion_time_s=RELEASED * 1e-3),
            Cause.MOTION_STALE,
            "101 ms, limit 100 ms (guard.stale_s)",
        ),
        (
            lambda r: r._replace(torque_time_s=r.torque_time_s + 0.05),
            Cause.STAMP_AHEAD,
            "50 ms, limit 21 ms",
        ),
        (
            lambda r: r._replace(cause=int(Cause.DRIVE_FAULT), motion_status=0x8),
            Cause.DRIVE_FAULT,
            "status word 0x8; read the fault",
        ),
        (
            lambda r: r._replace(cause=int(Cause.TORQUE_SATURATED), torque_nm=9.9),
            Cause.TORQUE_SATURATED,
            "9.9 N·m; lower prbs.amplitude_nm",
        ),
        (
            lambda r: r._replace(angle_rad=r.angle_rad + math.radians(9.0)),
            Cause.NOT_FOLLOWING,
            "9 deg, limit 2.4 deg",
        ),
    ],
)
def test_what_a_reading_shows(change, cause, said):
    account = stopped(change)
    assert account.cause is cause
    assert account.sentence.startswith(f"{cause.sentence}: {said}")


def test_a_joint_that_is_left_behind():
    """It is named at the first tick beyond the limit, so by no more than what one tick adds."""

    def change(r):
        return r._replace(angle_rad=min(r.angle_rad, 0.05))

    account = stopped(change, speed_rad_s=1.0, inertia_kg_m2=0.0045)
    assert account.cause is Cause.NOT_FOLLOWING
    beyond_deg = account.found.value - account.found.limit
    assert 0.0 < beyond_deg <= math.degrees(1.0 * 0.001)


def test_a_joint_that_moves_at_rest():
    drift = math.radians(1.5) / 1000

    def change(r):
        return r._replace(angle_rad=r.angle_rad + drift * (r.motion_time_s * 1000))

    account = stopped(change)
    assert account.cause is Cause.MOVED_AT_REST
    assert account.found.value == pytest.approx(1.0, abs=0.01)
    assert account.found.limit == pytest.approx(1.0, abs=0.001)
    assert account.found.duration_s > 0.6


def test_energy_that_goes_to_and_fro():
    """J v²/2 goes into an inertia that is brought to a speed; 0.1 J at 0.05 kg·m² and 2 rad/s."""
    values = {"guard": {"energy_limit_j": 0.09}}
    account = stopped(values=values, speed_rad_s=2.0, inertia_kg_m2=0.05)
    assert account.cause is Cause.ENERGY_HIGH
    assert account.found.value == pytest.approx(0.095, abs=0.005)
    assert account.found.limit == 0.09
    assert "for 1 s, limit 0.09 J (guard.energy_limit_j)" in account.sentence


def test_a_joint_against_its_limit():
    values = {"guard": {"position_limit_deg": 25.0}}
    account = stopped(values=values, speed_rad_s=3.0, inertia_kg_m2=0.0045)
    assert account.cause is Cause.HELD_AT_LIMIT
    assert account.sentence.startswith(
        f"{Cause.HELD_AT_LIMIT.sentence}: 1 s of the last 5 s, limit 1 s of the last 5 s; "
    )


def test_a_torque_that_does_not_answer():
    account = stopped(speed_rad_s=3.0)
    assert account.cause is Cause.TORQUE_SILENT
    assert "0 N·m, for 250 ms, at least 0.0" in account.sentence
    assert account.found.setting == "guard.min_inertia_kg_m2"


def test_a_velocity_that_is_not_the_change_of_the_angle():
    account = stopped(lambda r: r._replace(velocity_rad_s=0.5))
    assert account.cause is Cause.VELOCITY_WRONG
    assert account.found.value > account.found.limit > 0.1
    assert account.found.duration_s == 0.05


def test_readings_that_come_too_seldom():
    def change(r):
        old_s = 0.03 if r.torque_time_s % 0.06 < 0.045 else 0.0
        return r._replace(torque_time_s=r.torque_time_s - old_s)

    account = stopped(change)
    assert account.cause is Cause.SELDOM_FRESH
    assert 20.0 < account.found.value < 25.0
    assert account.sentence.startswith(f"{Cause.SELDOM_FRESH.sentence}: 20")


def test_the_first_cause_is_told_and_the_next_one_after_a_release():
    heard = []
    desk = Desk({3: Cause.TORQUE_HIGH, 6: Cause.EMERGENCY_STOP})
    loop, _ = made(SETTINGS, desk=desk, latched=lambda stop, _: heard.append(stop))
    run_ticks(loop, 1, 10, constant(0.0))
    run_ticks(loop, -1, 10, constant(0.0), latched=True)
    assert [account.cause for account in heard] == [Cause.TORQUE_HIGH]
    assert loop.reaction is Reaction.CUT
    assert loop.why == heard[0].sentence

    desk = Desk({3: Cause.TORQUE_HIGH, 12: Cause.POWER_HIGH})
    loop, _ = made(SETTINGS, desk=desk, latched=lambda stop, _: heard.append(stop))
    assert loop.why == Cause.NONE.sentence
    run_ticks(loop, 1, 10, constant(0.0))
    release(loop)
    assert loop.why == Cause.NONE.sentence
    run_ticks(loop, 1, 10, constant(0.0))
    assert [account.cause for account in heard[1:]] == [Cause.TORQUE_HIGH, Cause.POWER_HIGH]
