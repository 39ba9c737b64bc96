"""A recorded session through the guard once more: the same causes, limits and commands."""

import math

import numpy as np
import pytest
from tests.unit.rig.acquisition.exact_rig import Desk
from tests.unit.rig.acquisition.whole_session import session

from rigidimeter.core.session import Sample, SessionWriter, sample_dtypes
from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import prbs_nm, sinusoid
from rigidimeter.rig.acquisition import (
    Command,
    ControlLoop,
    SimulatedClock,
    follow,
    go_back,
    hold,
    perturb,
    ramp_to_rest,
    release,
    replay,
    replay_session,
)
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.guard import Cause, Limited

LIMITED = {
    "prbs": {"duration_s": 2.0, "amplitude_nm": 6.0},
    "sinusoid": {"duration_s": 2.0, "motion_s": 2.0, "taper_s": 0.5},
    "guard": {
        "position_limit_deg": 25.0,
        "speed_limit_deg_s": 100.0,
        "acceleration_limit_deg_s2": 2000.0,
    },
}
SETTINGS = parse_settings(LIMITED)
RATE_HZ = SETTINGS.rig.tick_rate_hz
OLD = [name for name in Sample._fields if name != "reported_cause"]
OLDEST = [name for name in OLD if name not in Sample._field_defaults]


class LateClock(SimulatedClock):
    """Every 97th tick comes 3 ms late."""

    def __init__(self):
        self.calls = 0

    def wait_until(self, time_s):
        self.calls += 1
        return time_s + 0.0032 * (self.calls % 97 == 0)


def columns_of(samples):
    return {
        name: np.array([getattr(sample, name) for sample in samples], dtype)
        for name, dtype in sample_dtypes().items()
    }


def made(spoil=None, clock=None, write=None):
    """Return a loop on the virtual rig, its samples, and what the guard latched for."""
    rig = SimulatedRig(SETTINGS.rig, SETTINGS.subject["OFF"], np.random.default_rng(4))
    read, wrote, ticks = rig.read, rig.write, [0]

    def reading(elapsed=1):
        ticks[0] += 1
        sample = read(elapsed)
        return sample if spoil is None else spoil(ticks[0], sample)

    rig.read = reading
    if write is not None:
        rig.write = lambda asked: wrote(write(asked))
    samples, events = [], []
    loop = ControlLoop(
        SETTINGS,
        rig,
        clock or SimulatedClock(),
        samples.append,
        latched=lambda stop, time_s: events.append(
            {"event": "guard_latched", "time_s": time_s, **stop.facts()}
        ),
    )
    rig.enable()
    return loop, samples, events


def recorded(spoil=None, clock=None, write=None):
    """Run PRBS, rest, sinusoid and the final stop in one go; return the columns and the events."""
    loop, samples, events = made(spoil, clock, write)
    perturb(loop, 1, prbs_nm(SETTINGS.prbs, RATE_HZ).tolist())
    go_back(loop, 0.5, 0.35)
    follow(loop, 2, *(column.tolist() for column in sinusoid(SETTINGS.sinusoid, RATE_HZ)))
    ramp_to_rest(loop)
    return columns_of(samples), events


def spoiled(at, **values):
    return lambda k, sample: sample._replace(**values) if k == at else sample


@pytest.mark.parametrize("clock", [SimulatedClock, LateClock])
def test_a_session_that_reached_every_limit_is_replayed_to_the_bit(clock):
    columns, events = recorded(clock=clock())
    found = replay(SETTINGS, columns, events, Sample._fields)
    assert set(columns["limited"]) == {
        *(Limited.NOT, Limited.ACCELERATION, Limited.SPEED, Limited.POSITION)
    }
    assert (found.differences, found.found, found.reported) == ((), (), ())
    assert (found.rounded_ticks, found.rounded_rad_s) == (0, 0.0)
    assert (found.ticks, found.left_out) == (len(columns["tick"]), "")
    (off,) = found.not_run
    assert "had no model of the drive" in off
    assert found.duration_s == pytest.approx(columns["tick"][-1] / RATE_HZ)


@pytest.mark.parametrize(
    ("spoil", "cause"),
    [
        ({"torque_nm": math.nan}, Cause.TORQUE_NOT_FINITE),
        ({"angle_rad": 0.3}, Cause.NOT_FOLLOWING),
        ({"torque_nm": 11.0}, Cause.TORQUE_HIGH),
    ],
)
def test_what_the_guard_found_it_finds_again_at_the_same_tick(spoil, cause):
    columns, events = recorded(spoiled(1200, **spoil))
    found = replay(SETTINGS, columns, events, Sample._fields)
    assert not found.differences
    (named,) = found.found
    assert (named.cause, named.tick) == (cause, 1199)
    assert named.time_s == pytest.approx(1.199)
    assert found.reported == ()


@pytest.mark.parametrize("cause", [Cause.DRIVE_FAULT, Cause.EMERGENCY_STOP])
@pytest.mark.parametrize("names", [Sample._fields, OLD])
def test_what_was_reported_is_told_to_it_and_said(cause, names):
    columns, events = recorded(spoiled(1200, cause=int(cause)))
    if names is OLD:
        columns["reported_cause"][:] = 0
    found = replay(SETTINGS, columns, events, names)
    assert not found.differences
    assert [(each.cause, each.tick) for each in found.reported] == [(cause, 1199)]
    assert ("the second is not known" in found.not_run[0]) == (names is OLD)


def test_a_second_cause_that_is_stronger_cuts_the_ramp_again():
    """The hold takes 10 ms to stop the arm; the emergency stop comes after 3 of them."""

    def spoil(k, sample):
        sample = sample._replace(torque_nm=11.0) if k == 1200 else sample
        return sample._replace(cause=int(Cause.EMERGENCY_STOP)) if k == 1203 else sample

    columns, events = recorded(spoil)
    assert set(columns["cause"][1199:]) == {Cause.TORQUE_HIGH}
    assert np.flatnonzero(columns["reported_cause"]).tolist() == [1202]
    assert columns["velocity_command_rad_s"][1201] != 0.0 == columns["velocity_command_rad_s"][1202]
    assert not replay(SETTINGS, columns, events, Sample._fields).differences


def test_a_late_loop_is_stopped_again_without_being_told():
    """25 ms late at one tick: `loop.stall_s`; the record says how late, and that is enough."""

    class Stalls(SimulatedClock):
        def wait_until(self, time_s):
            return time_s + (2.0 * SETTINGS.loop.stall_s) * (time_s == 0.7)

    columns, events = recorded(clock=Stalls())
    for told in (columns, {**columns, "reported_cause": 0 * columns["reported_cause"]}):
        found = replay(SETTINGS, told, events, Sample._fields)
        assert not found.differences
        assert [each.cause for each in found.found] == [Cause.STALLED]


@pytest.mark.parametrize("at_once", [False, True])
def test_a_hold_that_the_operator_ended_is_ended_again(at_once):
    """Also one that comes again at the next tick, where the record names the cause throughout."""

    def spoil(k, sample):
        return sample._replace(torque_nm=11.0) if k == 1200 or (at_once and k > 1200) else sample

    loop, samples, events = made(spoil)
    perturb(loop, 1, prbs_nm(SETTINGS.prbs, RATE_HZ).tolist())
    hold(loop, 0.1)
    release(loop)
    go_back(loop, 0.1, 0.35)
    columns = columns_of(samples)
    assert ((columns["cause"][1200:] == 0).any()) != at_once
    found = replay(SETTINGS, columns, events, Sample._fields)
    assert not found.differences
    assert [each.cause for each in found.found] == [Cause.TORQUE_HIGH] * (1 + at_once)


def test_a_drive_that_rounds_is_not_another_decision():
    unit_rad_s = 1e-3
    columns, events = recorded(write=lambda asked: unit_rad_s * round(asked / unit_rad_s))
    found = replay(SETTINGS, columns, events, Sample._fields)
    assert not found.differences
    assert found.rounded_ticks > 1000
    assert 0.4 * unit_rad_s < found.rounded_rad_s <= 0.5 * unit_rad_s * (1 + 1e-6)


@pytest.mark.parametrize(
    ("column", "what"),
    [("cause", "cause"), ("limited", "limit"), ("velocity_command_rad_s", "command")],
)
def test_a_decision_that_is_another_is_shown_with_tick_and_time(column, what):
    columns, events = recorded()
    columns[column][500] += 3 if what != "command" else 1e-9
    found = replay(SETTINGS, columns, events, Sample._fields)
    first = next(each for each in found.differences if each.what == what)
    assert (first.tick, first.time_s) == (500, 0.5)
    assert str(first).startswith(f"tick 500 (0.500 s): {what} ")
    assert found.differing_ticks >= 1


def test_another_guard_is_seen():
    """One reading of 9 N·m: below the 10 that were allowed, above 8, and where is said."""
    columns, events = recorded(spoiled(1200, torque_nm=9.0))
    assert not columns["cause"].any()
    values = {**LIMITED, "guard": {**LIMITED["guard"], "torque_limit_nm": 8.0}}
    found = replay(parse_settings(values), columns, events, Sample._fields)
    assert found.found[0][::2] == (1199, Cause.TORQUE_HIGH)
    assert str(found.differences[0]) == (
        "tick 1199 (1.199 s): cause NONE in the record, TORQUE_HIGH in the replay"
    )


def test_what_an_old_record_does_not_name_is_said():
    columns, events = recorded(spoiled(1200, torque_nm=11.0))
    columns["cause"][:] = columns["reported_cause"][:] = 0
    found = replay(SETTINGS, columns, events, OLDEST)
    assert not found.differences
    assert [each.cause for each in found.found] == [Cause.TORQUE_HIGH]
    assert "no cause is compared" in found.not_run[0]


def test_after_a_tick_that_is_not_in_the_record_nothing_is_claimed():
    columns, events = recorded()
    torn = {name: np.delete(column, 700) for name, column in columns.items()}
    found = replay(SETTINGS, torn, events, Sample._fields)
    assert (found.ticks, found.differences) == (700, ())
    assert "from tick 701 on" in found.left_out


def test_a_session_that_is_halted_by_the_operator_sends_nothing_more(tmp_path):
    """The power is off at once, while the guard still ramps down for a drive that might have it."""
    ran = session(Desk(orders={30: Command.HALT}))
    assert ran.result.cause is Cause.OPERATOR_HALT  # replayed by the fixture of this folder


@pytest.mark.parametrize("cut", [0.5, 0.02])
def test_a_folder_whose_end_is_missing_says_so(tmp_path, cut):
    """It was closed, so that the record is known to have gone on."""
    columns, _ = recorded()
    writer = SessionWriter(tmp_path / "s", SETTINGS, [], {}, virtual=True)
    for start in range(0, 1000, 100):
        writer.columns({name: column[start : start + 100] for name, column in columns.items()})
    writer.close(1.0, "success", "")
    path = tmp_path / "s" / "samples.arrows"
    content = path.read_bytes()
    path.write_bytes(content[: int(cut * len(content))])
    found = replay_session(tmp_path / "s")
    assert found.ticks < 1000
    assert "the end of samples.arrows is damaged or missing" in found.left_out


def test_a_line_of_the_events_that_cannot_be_read_is_named(tmp_path):
    """It may have been the range of motion, the zeroing or the model of the drive."""
    columns, _ = recorded()
    writer = SessionWriter(tmp_path / "s", SETTINGS, [], {}, virtual=True)
    writer.columns(columns)
    writer.event("sensor_zeroed", time_s=0.0, bias_nm=0.5, noise_sd_nm=0.01, refused="")
    writer.close(1.0, "success", "")
    path = tmp_path / "s" / "events.jsonl"
    path.write_text(path.read_text().replace('"bias_nm": 0.5', '"bias_nm": 0.7'))
    found = replay_session(tmp_path / "s")
    assert found.ticks == len(columns["tick"])
    assert "line 1 of events.jsonl is damaged" in found.left_out


def test_a_folder_is_replayed_and_says_from_where_samples_are_lost(tmp_path):
    columns, _ = recorded()
    writer = SessionWriter(tmp_path / "s", SETTINGS, [], {}, virtual=True)
    for start in range(0, 1000, 100):
        writer.columns({name: column[start : start + 100] for name, column in columns.items()})
    writer.close(1.0, "success", "")
    whole = replay_session(tmp_path / "s")
    assert (whole.ticks, whole.differences, whole.left_out) == (1000, (), "")
    path = tmp_path / "s" / "samples.arrows"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)
    torn = replay_session(tmp_path / "s")
    assert torn.differences == ()
    assert 0 < torn.ticks < 1000
    assert "its samples are lost" in torn.left_out
