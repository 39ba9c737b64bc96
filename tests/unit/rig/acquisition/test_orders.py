"""A session under an operator: paused, resumed, stopped, aborted, halted, changed, held."""

import json
import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from rigidimeter.core.session import SessionWriter, read_samples
from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan, prbs_nm
from rigidimeter.rig.acquisition import NOTHING, Command, Order, SimulatedClock, run_session
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.guard import Cause

VALUES = {
    "rig": {"tick_rate_hz": 200.0, "torque": {"rate_hz": 200.0}, "motion": {"rate_hz": 200.0}},
    "guard": {"reaction_time_s": 0.03},
    "prbs": {"duration_s": 2.0},
    "protocol": {"blocks": [{"epochs": 3}], "rests_s": [1.0], "return_s": 0.5},
}


@dataclass
class Desk:
    """Orders and causes by the tick at which they come."""

    orders: dict = field(default_factory=dict)
    causes: dict = field(default_factory=dict)
    attended: bool = True
    tick: int = 0
    measured: float = math.nan

    def cause(self, now_s):
        self.tick += 1
        return int(self.causes.get(self.tick, 0))

    def order(self):
        given = self.orders.pop(self.tick, NOTHING)
        return given if isinstance(given, Order) else Order(given)


class Clock(SimulatedClock):
    """On time, but for given ticks, which are late by so much."""

    def __init__(self, rate_hz=200.0, late=None):
        self.rate_hz, self.late = rate_hz, dict(late or {})

    def wait_until(self, deadline_s):
        return deadline_s + self.late.pop(round(deadline_s * self.rate_hz), 0.0)


def run(folder, desk=None, clock=None, rig=None, values=None, **options):
    settings = parse_settings({**VALUES, **(values or {})})
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, 1)
    rig = rig or SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
    writer = SessionWriter(folder, settings, [], {"session": 1}, virtual=True)
    result = run_session(
        protocol, settings, rig, clock or Clock(), writer, supervision=desk, **options
    )
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    return result, events, read_samples(folder / "samples.arrows")


def ended(events):
    return [(e["epoch"], e["outcome"]) for e in events if e["event"] == "epoch_ended"]


def labels(events):
    return [e["label"] for e in events if e["event"] == "epoch_started"]


def test_a_pause_comes_after_the_epoch_and_ends_with_resume(tmp_path):
    desk = Desk({100: Command.PAUSE, 1000: Command.RESUME})
    result, events, samples = run(tmp_path / "s", desk)
    assert result.outcome == "success"
    assert ended(events) == [(1, "success"), (2, "success"), (3, "success")]
    second = samples["tick"][samples["epoch"] == 2][0]
    assert second == 1100  # after a whole way back
    held = samples["velocity_command_rad_s"][700:1000]
    assert not held.any()


def test_a_pause_now_ends_the_epoch_which_is_run_again_first(tmp_path):
    desk = Desk({100: Command.PAUSE_NOW, 600: Command.RESUME})
    _, events, _ = run(tmp_path / "s", desk)
    assert ended(events)[0] == (1, "abort")
    assert labels(events) == ["1", "1r", "2", "3"]


def test_what_an_operator_notes_is_an_event_and_nothing_else_changes(tmp_path):
    rated = Order(Command.NOTE, '{"what": "rating", "epoch": 1, "score": 1.5, "time_s": 9}')
    desk = Desk({100: Order(Command.NOTE, '{"what": "mark", "text": "cough"}'), 500: rated})
    _, events, samples = run(tmp_path / "s", desk)
    _, _, same = run(tmp_path / "same")
    notes = [event for event in events if event["event"] == "note"]
    assert [note["time_s"] for note in notes] == pytest.approx([0.5, 2.5], abs=0.01)
    assert [note["during_epoch"] for note in notes] == [1, None]
    assert (notes[0]["text"], notes[1]["score"]) == ("cough", 1.5)
    np.testing.assert_array_equal(samples["angle_rad"], same["angle_rad"])


def test_stop_finishes_the_epoch(tmp_path):
    result, events, _ = run(tmp_path / "s", Desk({100: Command.STOP}))
    assert ended(events) == [(1, "success")]
    assert (result.outcome, result.epochs_good) == ("success", 1)
    assert result.reason == "stopped by the operator with 2 epochs left"


def test_abort_does_not_but_ramps_to_rest(tmp_path):
    result, events, samples = run(tmp_path / "s", Desk({100: Command.ABORT}))
    assert ended(events) == [(1, "abort")]
    assert result.outcome == "abort"
    command = samples["velocity_command_rad_s"]
    limit = math.radians(6000.0) / 200.0
    assert command[-1] == 0.0
    assert np.abs(np.diff(command)).max() <= limit * (1 + 1e-12)


def test_halt_takes_the_power_away_at_once(tmp_path):
    result, events, samples = run(tmp_path / "s", Desk({100: Command.HALT}))
    assert result.cause is Cause.OPERATOR_HALT
    assert events[-1]["outcome"] == "fail"
    assert not samples["velocity_command_rad_s"][100:].any()


def test_a_reported_emergency_stop_cuts_within_the_tick(tmp_path):
    result, _, samples = run(tmp_path / "s", Desk(causes={150: Cause.EMERGENCY_STOP}))
    assert result.cause is Cause.EMERGENCY_STOP
    row = np.flatnonzero(samples["cause"])[0]
    assert samples["tick"][row] == 149
    assert samples["velocity_command_rad_s"][row] == 0.0


def test_a_hold_is_a_pause_for_an_operator_and_the_end_without_one(tmp_path):
    desk = Desk({700: Command.RESUME}, {150: Cause.TORQUE_HIGH})
    result, events, _ = run(tmp_path / "held", desk)
    assert result.outcome == "success"
    assert ended(events) == [(1, "fail"), (2, "success"), (3, "success")]
    alone = Desk(causes={150: Cause.TORQUE_HIGH}, attended=False)
    result, events, _ = run(tmp_path / "alone", alone)
    assert ended(events) == [(1, "fail")]
    assert "no operator was there to continue" in result.reason


def test_a_stop_is_never_weakened_by_an_operator(tmp_path):
    desk = Desk({200: Command.RESUME, 210: Command.RESET}, {150: Cause.DRIVE_FAULT})
    result, events, samples = run(tmp_path / "s", desk)
    assert result.cause is Cause.DRIVE_FAULT
    assert len(ended(events)) == 1
    assert samples["velocity_command_rad_s"][-1] == 0.0


def test_the_first_cause_is_kept(tmp_path):
    desk = Desk(causes={150: Cause.DRIVE_FAULT, 151: Cause.EMERGENCY_STOP})
    result, _, samples = run(tmp_path / "s", desk)
    assert result.cause is Cause.DRIVE_FAULT
    assert set(samples["cause"]) == {0, int(Cause.DRIVE_FAULT)}
    assert samples["velocity_command_rad_s"][150] == 0.0  # and the stronger reaction taken


def test_parameters_change_within_bounds_without_a_bump_and_are_logged(tmp_path):
    desk = Desk(
        {
            100: Order(Command.CHANGE, "damping_nm_s_rad", 3.2),
            110: Order(Command.CHANGE, "damping_nm_s_rad", 0.1),
            120: Order(Command.CHANGE, "perturbation_scale", 0.5),
            130: Order(Command.CHANGE, "perturbation_scale", math.nan),
            140: Order(Command.CHANGE, "position_limit_deg", 90.0),
        }
    )
    result, events, samples = run(tmp_path / "s", desk)
    assert result.outcome == "success"
    told = [e for e in events if e["event"] == "order"]
    assert told[0]["before"] == pytest.approx(1.604, abs=1e-3)
    assert [("refused" in e) for e in told] == [False, True, False, True, True]
    change = np.abs(np.diff(samples["velocity_command_rad_s"][:400]))
    assert change[95:105].max() <= change[:400].max()
    plain = prbs_nm(parse_settings(VALUES).prbs, 200.0)[:400]
    np.testing.assert_allclose(samples["perturbation_nm"][125:390], 0.5 * plain[125:390])


def test_an_epoch_at_the_limit_is_run_again_at_the_end_if_wanted(tmp_path):
    values = {
        "guard": {"position_limit_deg": 8.0, "reaction_time_s": 0.03},
        "protocol": {**VALUES["protocol"], "repeat_limited": True, "rests_s": [5.0]},
        "sinusoid": {"amplitude_deg": 1.0},
    }
    _, events, _ = run(tmp_path / "s", Desk(), values=values)
    assert labels(events) == ["1", "2", "3", "1r", "2r", "3r"]
    assert {outcome for _, outcome in ended(events)} == {"fail"}


def test_the_sensor_is_zeroed_before_the_first_epoch(tmp_path):
    settings = parse_settings(VALUES)
    rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
    rig.zero(-0.25)  # it reads 0.25 N·m too much
    _, events, samples = run(tmp_path / "s", Desk(), rig=rig, zero_first=True)
    zeroed = next(e for e in events if e["event"] == "sensor_zeroed")
    assert zeroed["bias_nm"] == pytest.approx(0.25, abs=0.002)
    assert zeroed["noise_sd_nm"] == pytest.approx(0.005, rel=0.2)
    epoch = samples["epoch"] > 0
    assert abs(samples["torque_nm"][epoch].mean()) < 0.1


@pytest.mark.parametrize(
    ("subject", "bias_nm", "words"),
    [({}, 3.0, "zeroed under load"), ({"tremor_amplitude_nm": 1.0}, 0.0, "the subject moves")],
)
def test_a_run_does_not_begin_on_a_sensor_under_load(tmp_path, subject, bias_nm, words):
    settings = parse_settings({**VALUES, "subject": {"OFF": subject}})
    rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
    rig.zero(-bias_nm)
    result, events, _ = run(tmp_path / "s", Desk(), rig=rig, zero_first=True)
    assert result.outcome == "fail"
    assert words in result.reason
    assert labels(events) == []


@pytest.mark.parametrize(
    ("speed_deg_s", "words"),
    [
        (0.1, ""),  # 0.05 deg in the half second
        (0.8, "moved by 0.39"),
        (2.5, "commanded to rest"),
    ],
)
def test_a_zero_is_not_made_from_a_joint_that_moves(tmp_path, speed_deg_s, words):
    """The zero offset of a drive: its torque at rest is that of damping and stiffness."""
    settings = parse_settings({**VALUES, "zeroing": {"duration_s": 0.5}})
    rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
    plain = rig.write
    rig.write = lambda velocity: plain(velocity + math.radians(speed_deg_s)) and velocity
    values = {
        "zeroing": {"duration_s": 0.5},
        "guard": {"hold_limit_deg": 0.5, "reaction_time_s": 0.03},
    }
    result, events, _ = run(tmp_path / "s", Desk(), rig=rig, values=values, zero_first=True)
    zeroed = [e for e in events if e["event"] == "sensor_zeroed"]
    if words:
        assert (result.outcome, labels(events)) == ("fail", [])
        assert words in result.reason
    else:
        assert zeroed[0]["refused"] == ""


def test_an_epoch_after_a_pause_begins_where_epochs_begin(tmp_path):
    values = {"protocol": {**VALUES["protocol"], "blocks": [{"task": "sinusoid", "epochs": 1}]}}
    desk = Desk({300: Command.PAUSE_NOW, 310: Command.RESUME})
    _, events, samples = run(tmp_path / "s", desk, values=values)
    assert labels(events) == ["1", "1r"]
    again = samples["angle_rad"][samples["epoch"] == 2]
    assert abs(again[0]) < math.radians(0.5)


@pytest.mark.parametrize("order", [Command.PAUSE_NOW, None])
def test_a_zero_is_made_from_the_whole_time_or_not_at_all(tmp_path, order):
    """An order or a hold in the middle of it: it is made again, never left out."""
    settings = parse_settings(VALUES)
    rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
    rig.zero(-0.9)
    if order is None:
        desk = Desk({200: Command.RESUME}, {20: Cause.TORQUE_HIGH})
    else:
        desk = Desk({20: order, 200: Command.RESUME})
    result, events, _ = run(tmp_path / "s", desk, rig=rig, zero_first=True)
    zeroed = [e for e in events if e["event"] == "sensor_zeroed"]
    assert [e["bias_nm"] for e in zeroed] == [pytest.approx(0.9, abs=0.002)]
    assert zeroed[0]["time_s"] > 2.9
    assert result.outcome == "success"


def test_an_abort_while_zeroing_is_an_abort(tmp_path):
    result, events, _ = run(tmp_path / "s", Desk({3: Command.ABORT}), zero_first=True)
    assert result.outcome == "abort"
    assert labels(events) == []


def test_a_second_hold_on_the_way_back_is_another_pause(tmp_path):
    causes = {150: Cause.TORQUE_HIGH, 350: Cause.TORQUE_HIGH}
    desk = Desk({300: Command.RESUME, 600: Command.RESUME}, causes)
    result, events, _ = run(tmp_path / "s", desk)
    assert ended(events) == [(1, "fail"), (2, "success"), (3, "success")]
    assert result.outcome == "success"


def test_an_ordered_stop_outlives_a_hold(tmp_path):
    desk = Desk({100: Command.STOP, 600: Command.RESUME}, {150: Cause.TORQUE_HIGH})
    result, events, _ = run(tmp_path / "s", desk)
    assert ended(events) == [(1, "fail")]
    assert result.reason == "stopped by the operator with 2 epochs left"


def test_a_stop_in_a_rest_ends_it(tmp_path):
    _, events, samples = run(tmp_path / "s", Desk({450: Command.STOP}))
    assert ended(events) == [(1, "success")]
    assert samples["tick"][-1] < 480


def test_a_release_waits_for_rest_and_forgets_nothing_in_flight(tmp_path):
    values = {"guard": {"acceleration_limit_deg_s2": 300.0, "reaction_time_s": 0.03}}
    desk = Desk({152: Command.RESUME}, {150: Cause.TORQUE_HIGH})
    _, _, samples = run(tmp_path / "s", desk, values=values)
    change = np.abs(np.diff(samples["velocity_command_rad_s"]))
    assert change.max() <= math.radians(300.0) / 200.0 * (1 + 1e-9)


def test_missed_deadlines_are_left_out_not_made_up_for(tmp_path):
    clock = Clock(late={100: 0.012})  # two ticks and a bit
    result, events, samples = run(tmp_path / "s", clock=clock)
    assert result.outcome == "success"
    ticks = samples["tick"]
    assert list(ticks[99:102]) == [99, 102, 103]
    assert samples["lateness_s"][100] == pytest.approx(0.012)
    assert next(e for e in events if e["event"] == "epoch_ended")["missed_ticks"] == 2
    # Perturbation and epoch stay where the time is.
    assert np.count_nonzero(samples["epoch"] == 1) == 398
    assert ticks[samples["epoch"] == 1][-1] == 399


def test_the_controller_steps_over_the_time_that_passed(tmp_path):
    _, _, late = run(tmp_path / "late", clock=Clock(late={100: 0.012}))
    _, _, timely = run(tmp_path / "timely")
    at_103 = [s["angle_rad"][s["tick"] == 120][0] for s in (late, timely)]
    assert at_103[0] == pytest.approx(at_103[1], abs=math.radians(1.0))


@pytest.mark.parametrize(
    ("late", "cause"),
    [
        ({100: 0.101}, Cause.STALLED),
        ({tick: 0.006 for tick in range(100, 200)}, Cause.DEADLINES_MISSED),
    ],
)
def test_a_loop_that_falls_behind_stops(tmp_path, late, cause):
    result, events, samples = run(tmp_path / "s", clock=Clock(late=late))
    assert result.cause is cause
    assert samples["velocity_command_rad_s"][-1] == 0.0
    assert cause.sentence in events[-1]["reason"]
