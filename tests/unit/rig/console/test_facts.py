"""What the operator is told, from plan, progress and what the processes show."""

import math

import numpy as np
import pytest
from tests.unit.rig.console.test_session_progress import EPOCHS, ended, started, told

from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition import Phase, State
from rigidimeter.rig.acquisition.processes import (
    PAUSE_NEXT,
    ROW,
    STOP_NEXT,
    LiveEstimate,
    LoopStatus,
    ProcessCondition,
)
from rigidimeter.rig.console import (
    EmgState,
    Facts,
    Level,
    RecentSamples,
    RecorderState,
    SessionPlan,
    all_indicators,
    facts,
    limit_distances,
    recent_samples,
)
from rigidimeter.rig.guard import Cause

SETTINGS = Settings()
PLAN = SessionPlan(SETTINGS, EPOCHS)
RUNNING = LoopStatus(
    State.RUNNING, 30_000, 1, time_s=30.0, angle_rad=0.1, until_s=45.0, phase=Phase.EPOCH
)
RETURN_S = SETTINGS.protocol.return_s
QUIET = RecentSamples(
    1000, 0.5, math.radians(10), math.radians(50), 1.0, 0.8, 1e-4, 1e-3, 2e-3, 0, 0, False
)
SMALL_DISK = RecorderState(ProcessCondition.RUNNING, "", 0.1, 0, 0, 5 * 10**8)
WELL = RecorderState(ProcessCondition.RUNNING, "", 0.05, 100, 500, 40 * 10**9)


def shown(progress, loop=RUNNING, plan=PLAN, **more) -> Facts:
    return facts(plan, progress, loop, recent=QUIET, recorder=WELL, **more)


def test_epoch_countdown_counts_and_what_is_left():
    found = shown(told(started(1, "1", 25.0)))
    assert found.epoch.text == "epoch 1 of 3: OFF, prbs"
    assert found.next_epoch.text == "epoch 2 of 3: OFF, sinusoid"
    assert (found.countdown_words, found.countdown_s) == ("epoch", 15.0)
    # 15 s of this epoch, its rest of 10 s, then 20 + 20 s and 20 + 10 s; a return after each.
    assert found.session_left_s == 15.0 + 10.0 + 40.0 + 30.0 + 3 * RETURN_S
    assert [(c.condition, c.good, c.bad, c.left) for c in found.counts] == [
        ("OFF", 0, 0, 2),
        ("DBS", 0, 0, 1),
    ]
    assert found.state_words == "epoch runs"
    assert found.angle_deg == pytest.approx(5.73, abs=0.01)


def test_in_a_rest_the_rest_is_counted_down_and_the_next_epoch_named():
    found = shown(told(started(1, "1"), ended(1)), RUNNING._replace(epoch=-1, phase=Phase.REST))
    assert found.state_words == "rest"
    assert found.epoch is None
    assert found.next_epoch.place == 2
    assert (found.countdown_words, found.countdown_s) == ("rest", 15.0)
    assert found.session_left_s == 15.0 + 40.0 + 30.0 + 2 * RETURN_S
    assert (found.counts[0].good, found.counts[0].left) == (1, 1)


def test_the_way_back_is_announced_and_its_rest_still_comes():
    loop = RUNNING._replace(epoch=-1, phase=Phase.RETURN, until_s=32.0)
    found = shown(told(started(1, "1"), ended(1)), loop)
    assert found.state_words == "the arm moves back to its start"
    assert (found.countdown_words, found.countdown_s) == ("return", 2.0)
    assert found.session_left_s == 2.0 + 10.0 + 40.0 + 30.0 + 2 * RETURN_S
    stopping = shown(told(started(1, "1"), ended(1)), loop._replace(phase=Phase.HOLD))
    assert (stopping.state_words, stopping.countdown_words) == ("the arm comes to rest", "")


def test_a_repetition_keeps_its_place_and_counts_as_left():
    progress = told(started(1, "1"), ended(1, "abort", again_as=4))
    assert (progress.ended[0].outcome, shown(progress).counts[0].bad) == ("abort", 1)
    assert shown(progress).counts[0].left == 2
    found = shown(told(started(1, "1"), ended(1, "abort", again_as=4), started(4, "1r")))
    assert found.epoch.text == "epoch 1 of 3, again: OFF, prbs"


def test_a_session_that_is_continued_keeps_its_numbers():
    plan = SessionPlan(SETTINGS, EPOCHS[1:], done_before=1)
    assert plan.total == 3
    assert SessionPlan(SETTINGS, EPOCHS[2:], done_before=1).total == 3  # continued twice
    assert SessionPlan(SETTINGS, ()).total == 0


def test_before_the_first_epoch_the_sensor_is_zeroed():
    loop = RUNNING._replace(epoch=-1, time_s=0.5, until_s=2.0, phase=Phase.ZEROING)
    assert shown(told(), loop).countdown_words == "zero of the torque sensor"
    assert shown(told(), loop).state_words == "the torque sensor is zeroed"


def test_in_a_pause_nothing_is_counted_down():
    loop = RUNNING._replace(state=State.PAUSED, until_s=30.1, phase=Phase.HOLD, still=1)
    found = shown(told(started(1, "1"), ended(1)), loop)
    assert (found.countdown_words, found.state_words) == ("", "paused, the arm is still")
    assert found.session_left_s == 70.0 + 2 * RETURN_S
    moving = shown(told(started(1, "1"), ended(1)), loop._replace(still=0))
    assert moving.state_words == "paused, the arm comes to rest"
    held = loop._replace(cause=int(Cause.TORQUE_HIGH))
    assert shown(told(), held).state_words == "held by the guard, the arm is still"
    assert shown(told(), held).stop_words == f"held: {Cause.TORQUE_HIGH.sentence}"
    why = told({"event": "guard_latched", "sentence": "the torque was 11 N·m"})
    assert shown(why, held).stop_words == "held: the torque was 11 N·m"


@pytest.mark.parametrize(
    ("pending", "words"),
    [
        (PAUSE_NEXT, "epoch runs, pauses after this epoch"),
        (STOP_NEXT, "epoch runs, ends after this epoch"),
        (PAUSE_NEXT + STOP_NEXT, "epoch runs, ends after this epoch"),
    ],
)
def test_what_comes_after_this_epoch_is_said(pending, words):
    assert shown(told(started(1, "1")), RUNNING._replace(pending=pending)).state_words == words


def test_a_blinded_operator_reads_codes_alone():
    plan = SessionPlan(SETTINGS, EPOCHS, codes={"OFF": "A"})
    found = shown(told(started(1, "1")), plan=plan)
    assert found.epoch.condition == "A"
    assert [count.condition for count in found.counts] == ["A", "(blinded)"]
    assert "DBS" not in repr(found)
    assert "OFF" not in repr(found)


def test_live_values_are_of_the_epoch_that_was_estimated():
    live = LiveEstimate(epoch=1, time_s=10.0, memory_s=4.0)
    found = shown(told(started(1, "1"), ended(1)), history=[live])
    assert found.live_words == "epoch 1"
    assert found.live[2].why_not == "not known yet"
    short = [live._replace(time_s=2.0)]
    assert shown(told(started(1, "1")), history=short).live[2].why_not == "in 3 s"
    over = shown(told(started(1, "1"), ended(1)), history=short)
    assert over.live[2].why_not == "not known: the epoch was too short"


def test_how_it_ended_is_said():
    over = told({"event": "session_ended", "outcome": "abort", "reason": "aborted"})
    found = shown(over)
    assert (found.state_words, found.stop_words) == ("ended: abort", "aborted")
    assert found.session_left_s == 0.0


def test_distances_are_in_the_units_of_the_limits():
    angle, speed, torque, power, energy = limit_distances(SETTINGS.guard, QUIET, 4.5)
    assert (angle.value, angle.part) == pytest.approx((10.0, 0.25))
    assert (speed.unit, speed.part) == ("deg/s", pytest.approx(0.25))
    assert (torque.value, power.value) == pytest.approx((1.0, 0.8))
    assert (energy.near, torque.near) == (True, False)
    assert energy.part == pytest.approx(0.9)
    assert angle.text == "10.0 of 40 deg"
    assert energy.text == "4.50 of 5 J"
    assert limit_distances(SETTINGS.guard, QUIET, 2e-6)[-1].text == "0.00 of 5 J"


def lit(loop=RUNNING, recent=QUIET, recorder=WELL, energy_j=0.5, left_s=60.0):
    distances = limit_distances(SETTINGS.guard, recent, energy_j)
    made = all_indicators(SETTINGS, loop, recent, distances, recorder, left_s)
    return {indicator.name: indicator for indicator in made}


def test_all_lamps_are_good_and_say_what_they_know():
    found = lit()
    lamps = ["limits", "sensor", "drive", "lateness", "recorder", "disk", "dose"]
    assert list(found) == lamps
    assert {indicator.level for indicator in found.values()} == {Level.GOOD}
    assert found["limits"].words == "angle 10.0 of 40 deg (25 %)"
    assert found["sensor"].words == "torque 1 ms old, limit 100 ms"
    assert found["lateness"].words == (
        "at most 0.1 ms late, limit 40 ms; 0 late and 0 missed of 30001 ticks"
    )
    assert found["recorder"].words == "0.1 s of samples wait, limit 2 s"
    assert found["disk"].words == "40.0 GB free, 0 s not yet on the disk"
    assert found["dose"].words == (
        "0 of 120 epochs, 0.0 of 60 min of motion, 0 of 30 arrivals at the position limit"
    )
    assert len({level.sign for level in Level}) == len(Level)


@pytest.mark.parametrize(
    ("emg", "level", "words"),
    [
        (EmgState(), Level.UNKNOWN, "starts"),
        (EmgState(ProcessCondition.RUNNING, "", 0.1), Level.GOOD, "is recorded"),
        (EmgState(ProcessCondition.RUNNING, "", 3.0), Level.WATCH, "its process does not answer"),
        (EmgState(ProcessCondition.TROUBLE, "missing since 3.0 s", 0.1), Level.WATCH, "missing"),
        (EmgState(ProcessCondition.FAILED, "ended at 3.0 s: x", 9.0), Level.WATCH, "ended at 3.0"),
        (EmgState(ProcessCondition.DONE, "", 9.0), Level.GOOD, "all is in the file"),
    ],
)
def test_emg_that_is_missing_is_named_and_stops_nothing(emg, level, words):
    found = shown(told(started(1, "1")), emg=emg)
    lamp = found.indicators[-1]
    assert (lamp.name, lamp.level) == ("EMG", level)
    assert lamp.words.startswith(words)
    assert found.emg_words == (f"EMG: {lamp.words}" if level is Level.WATCH else "")
    assert found.stop_words == ""


@pytest.mark.parametrize(("epochs", "level"), [(95, Level.GOOD), (96, Level.WATCH)])
def test_the_dose_of_the_last_epoch_is_shown_and_near_its_limit_asks_for_attention(epochs, level):
    done = {"epochs": epochs, "motion_s": 60.0, "arrivals": 2}
    progress = told(started(1, "1"), ended(1, dose=done))
    dose = next(one for one in shown(progress).indicators if one.name == "dose")
    assert dose.level is level
    assert dose.words.startswith(f"{epochs} of 120 epochs, 1.0 of 60 min of motion, 2 of 30")


@pytest.mark.parametrize(
    ("name", "level", "changed"),
    [
        ("limits", Level.WATCH, {"energy_j": 4.5}),
        ("limits", Level.WATCH, {"recent": QUIET._replace(held_back=True)}),
        ("limits", Level.UNKNOWN, {"recent": RecentSamples(), "energy_j": math.nan}),
        ("sensor", Level.WATCH, {"recent": QUIET._replace(torque_age_s=0.06)}),
        ("sensor", Level.BAD, {"recent": QUIET._replace(torque_age_s=math.nan)}),
        ("sensor", Level.UNKNOWN, {"recent": RecentSamples()}),
        ("drive", Level.WATCH, {"recent": QUIET._replace(motion_age_s=0.06)}),
        ("lateness", Level.WATCH, {"recent": QUIET._replace(largest_lateness_s=2e-3)}),
        (
            "recorder",
            Level.WATCH,
            {"recorder": RecorderState(ProcessCondition.RUNNING, "", 0.1, 1500)},
        ),
        ("recorder", Level.WATCH, {"recorder": RecorderState(ProcessCondition.RUNNING, "", 1.5)}),
        ("recorder", Level.BAD, {"recorder": RecorderState(ProcessCondition.TROUBLE, "full", 0.1)}),
        ("recorder", Level.BAD, {"recorder": RecorderState(ProcessCondition.FAILED)}),
        ("recorder", Level.UNKNOWN, {"recorder": RecorderState()}),
        ("recorder", Level.GOOD, {"recorder": RecorderState(ProcessCondition.DONE)}),
        ("disk", Level.BAD, {"recorder": RecorderState(ProcessCondition.TROUBLE, "full", 0.1)}),
        ("disk", Level.UNKNOWN, {"recorder": RecorderState(ProcessCondition.RUNNING)}),
        # An hour at 1000 samples of 152 bytes a second is 547 MB.
        ("disk", Level.WATCH, {"recorder": SMALL_DISK, "left_s": 3600.0}),
    ],
)  # fmt: skip
def test_a_lamp_tells_what_is_wrong(name, level, changed):
    assert lit(**changed)[name].level is level


@pytest.mark.parametrize(
    ("cause", "names"),
    [
        (Cause.ENERGY_HIGH, ["limits"]),
        (Cause.TORQUE_FROZEN, ["sensor"]),
        (Cause.DRIVE_LOST, ["drive"]),
        (Cause.STALLED, ["lateness"]),
        (Cause.RECORD_OVERFLOW, ["recorder", "disk"]),
        (Cause.EMERGENCY_STOP, []),
    ],
)
def test_the_lamp_of_a_cause_says_it(cause, names):
    found = lit(RUNNING._replace(cause=int(cause)))
    assert [name for name, indicator in found.items() if indicator.level is Level.BAD] == names
    assert all(found[name].words == cause.sentence for name in names)


def test_the_last_second_in_numbers():
    rows = np.zeros(1000, ROW)
    rows["time_s"] = 1e-3 * np.arange(1, 1001)
    rows["torque_time_s"] = rows["time_s"] - 1e-3
    rows["motion_time_s"] = rows["time_s"] - 2e-3
    rows["torque_nm"][:-100], rows["torque_nm"][-100:] = 9.0, 1.0
    rows["torque_nm"][500] = -12.0
    rows["drive_torque_nm"][-100:] = 2.5
    rows["velocity_rad_s"] = -0.5
    rows["angle_rad"][3], rows["angle_rad"][4] = -0.3, math.nan
    rows["lateness_s"][7] = 4e-3
    rows["limited"][9] = 3
    found = recent_samples(rows)
    assert found.samples == 1000
    assert found.torque_nm == pytest.approx(1.0)
    assert found.drive_torque_nm == pytest.approx(2.5)
    assert found.largest_angle_rad == 0.3
    assert (found.lowest_angle_rad, found.highest_angle_rad) == (-0.3, 0.0)
    assert found.largest_torque_nm == 12.0
    assert found.largest_power_w == 6.0
    assert found.largest_lateness_s == 4e-3
    assert (found.torque_age_s, found.motion_age_s) == pytest.approx((1e-3, 2e-3))
    assert found.held_back
    assert not recent_samples(rows[:5]).held_back
    assert recent_samples(rows[:0]) == pytest.approx(RecentSamples(), nan_ok=True)
    rows["torque_nm"] = math.nan
    assert math.isnan(recent_samples(rows).torque_nm)


def test_of_a_range_the_nearer_end_is_shown():
    recent = QUIET._replace(
        largest_angle_rad=0.3, lowest_angle_rad=-0.1, highest_angle_rad=math.radians(20.0)
    )
    enabled = {"event": "rig_enabled", "range_rad": [math.radians(-6.0), math.radians(60.0)]}
    ends = told(enabled).range_rad
    assert told({"event": "rig_enabled", "range_rad": None}).range_rad is None
    angle = limit_distances(SETTINGS.guard, recent, 0.0, ends)[0]
    assert (angle.value, angle.limit) == (pytest.approx(math.degrees(0.1)), pytest.approx(6.0))
    assert angle.near
    other = recent._replace(lowest_angle_rad=0.2)  # beyond the start on the other side
    angle = limit_distances(SETTINGS.guard, other, 0.0, ends)[0]
    assert (angle.value, angle.limit) == (pytest.approx(20.0), 40.0)


def test_wild_samples_are_said_beside_the_sensor():
    for count, words in ((1, "1 single torque sample was"), (3, "3 single torque samples were")):
        progress = told(started(1, "1"), ended(1, counts={"torque_wild": count}))
        said = {one.name: one.words for one in shown(progress).indicators}
        assert said["sensor"].startswith(f"{words} far from the others")
