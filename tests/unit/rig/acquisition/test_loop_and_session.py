"""The loop on a rig made for the test: what it does when readings or the rig go wrong."""

import json
import math

import numpy as np
import pytest

from rigidimeter.core.session import SessionWriter, read_samples
from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import (
    ControlLoop,
    SimulatedClock,
    follow,
    ramp_to_rest,
    run_session,
)
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.devices.base import Reading
from rigidimeter.rig.guard import Cause

SETTINGS = parse_settings(
    {
        "protocol": {"blocks": [{"epochs": 2}], "rests_s": [1.0], "return_s": 1.0},
        "prbs": {"duration_s": 1.0},
    }
)


class SpoiledRig:
    """The virtual rig, but what it reads from a given tick on is changed."""

    def __init__(self, spoil, from_tick=500):
        self.rig = SimulatedRig(SETTINGS.rig, SETTINGS.subject["OFF"], np.random.default_rng(1))
        self.spoil, self.from_tick = spoil, from_tick
        self.tick = 0
        self.disabled = 0

    def __getattr__(self, name):
        return getattr(self.rig, name)

    def read(self, elapsed_ticks=1):
        reading = self.rig.read(elapsed_ticks)
        self.tick += 1
        return self.spoil(reading) if self.tick > self.from_tick else reading

    def disable(self):
        self.disabled += 1
        self.rig.disable()


def run(rig, folder, clock=None, **options):
    protocol = plan(SETTINGS.protocol, SETTINGS.prbs, SETTINGS.sinusoid, 1)
    writer = SessionWriter(folder, SETTINGS, [], {"session": 1}, virtual=True)
    return run_session(protocol, SETTINGS, rig, clock or SimulatedClock(), writer, **options)


def events(folder):
    return [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda r: r._replace(torque_nm=math.nan), "torque sensor"),
        (lambda r: r._replace(torque_nm=math.inf), "torque sensor"),
        (lambda r: r._replace(angle_rad=math.nan), "angle or velocity"),
        (lambda r: r._replace(velocity_rad_s=-math.inf), "angle or velocity"),
        (lambda r: r._replace(angle_rad=2.0), "beyond the position limit"),
    ],
)
def test_a_bad_reading_stops_the_rig_and_closes_the_record(tmp_path, spoil, words):
    rig = SpoiledRig(spoil)
    result = run(rig, tmp_path / "s")
    assert (result.outcome, result.epochs_run) == ("fail", 1)
    assert words in result.reason
    assert rig.disabled == 1
    kinds = [(e["event"], e.get("outcome")) for e in events(tmp_path / "s")]
    assert kinds[-2:] == [("epoch_ended", "fail"), ("session_ended", "fail")]
    samples = read_samples(tmp_path / "s" / "samples.arrows")
    sent = samples["velocity_command_rad_s"]
    assert np.isfinite(sent).all()
    # The ramp to rest keeps to the deceleration limit.
    limit = np.deg2rad(SETTINGS.guard.acceleration_limit_deg_s2) / SETTINGS.rig.tick_rate_hz
    assert np.abs(np.diff(sent)[499:]).max() <= limit * (1 + 1e-9)
    assert sent[-1] == 0.0
    assert (samples["limited"][500:] == 4).all()


def test_a_bad_torque_does_not_enter_the_filter(tmp_path):
    """One NaN in a recursive filter would stay for ever; the record shows that it did not."""
    rig = SpoiledRig(lambda r: r._replace(torque_nm=math.nan))
    run(rig, tmp_path / "s")
    asked = read_samples(tmp_path / "s" / "samples.arrows")["velocity_request_rad_s"]
    assert np.isfinite(asked[501:]).all()


def test_a_rig_that_raises_is_disabled_and_the_record_closed(tmp_path):
    def fail(_):
        raise OSError("the wire came off")

    rig = SpoiledRig(fail)
    with pytest.raises(OSError, match="wire came off"):
        run(rig, tmp_path / "s")
    assert rig.disabled == 1
    ended = [e for e in events(tmp_path / "s") if e["event"].endswith("_ended")]
    assert [e["outcome"] for e in ended] == ["fail", "fail"]
    assert "the wire came off" in ended[0]["reason"]
    assert len(read_samples(tmp_path / "s" / "samples.arrows")["tick"]) == 500


def test_the_arm_returns_to_where_it_began(tmp_path):
    rig = SpoiledRig(lambda r: r)
    run(rig, tmp_path / "s")
    samples = read_samples(tmp_path / "s" / "samples.arrows")
    assert np.abs(samples["angle_rad"][:1000]).max() > 0.05
    assert abs(samples["angle_rad"][1990]) < 0.005


def test_a_ramp_to_rest_takes_as_long_as_it_needs():
    """2 s at these limits: what were left of it after a second would be cut with the power."""
    guard = {"speed_limit_deg_s": 40.0, "acceleration_limit_deg_s2": 20.0}
    settings = parse_settings({"guard": {**guard, "position_limit_deg": 180.0}})
    rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
    samples = []
    loop = ControlLoop(settings, rig, SimulatedClock(), samples.append)
    rig.enable()
    rate_hz = settings.rig.tick_rate_hz
    n = round(2.5 * rate_hz)
    speed_rad_s = math.radians(40.0)
    follow(loop, 1, [speed_rad_s * k / rate_hz for k in range(n)], [speed_rad_s] * n)
    at = len(samples)
    fastest = samples[-1].velocity_command_rad_s
    assert fastest == pytest.approx(speed_rad_s)
    ramp_to_rest(loop)
    sent = np.array([sample.velocity_command_rad_s for sample in samples[at - 1 :]])
    assert sent[-1] == 0.0
    assert len(sent) - 1 == pytest.approx(2.0 * rate_hz, abs=1)
    np.testing.assert_allclose(np.diff(sent)[:-1], -math.radians(20.0) / rate_hz, rtol=1e-9)


def test_what_comes_before_an_epoch_is_stored_with_it(tmp_path):
    run(SpoiledRig(lambda r: r), tmp_path / "s", before_epoch=lambda p: {"note": p.label * 2})
    started = [e for e in events(tmp_path / "s") if e["event"] == "epoch_started"]
    assert [e["note"] for e in started] == ["11", "22"]


def test_progress_reaches_the_end(tmp_path):
    reached = []
    run(SpoiledRig(lambda r: r), tmp_path / "s", progress=reached.append)
    assert reached == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def test_a_rig_without_power_does_not_move():
    rig = SimulatedRig(SETTINGS.rig, SETTINGS.subject["OFF"], np.random.default_rng(1))
    assert rig.write(1.0) == 0.0
    rig.enable()
    assert rig.write(1.0) == 1.0
    rig.disable()
    for _ in range(200):
        reading = rig.read()
    assert isinstance(reading, Reading)
    assert reading.angle_rad == 0.0


def test_a_stamp_ahead_of_its_tick_does_not_end_an_imposed_motion():
    """A reading taken within a late tick may be younger than it: no later target is there."""
    rig = SpoiledRig(lambda r: r._replace(motion_time_s=r.motion_time_s + 0.0016), from_tick=0)
    loop = ControlLoop(SETTINGS, rig, SimulatedClock(), lambda _: None)
    rig.enable()
    target_rad = [1e-4 * k for k in range(50)]
    ended = follow(loop, 1, target_rad, [0.1] * 50)
    assert (loop.tick, ended.cause) == (50, 0)


def test_a_cut_takes_the_power_within_its_tick():
    """Before anything else is written, and not only when the session closes."""
    rig, calls = SpoiledRig(lambda r: r._replace(cause=int(Cause.EMERGENCY_STOP)), 20), []
    rig.disable = lambda: calls.append("disable")
    rig.write = lambda velocity: calls.append("write") or velocity
    loop = ControlLoop(SETTINGS, rig, SimulatedClock(), lambda _: None)
    follow(loop, 1, [0.0] * 40, [0.0] * 40)
    assert calls == [*["write"] * 20, "disable", "write"]


def test_one_torque_that_is_no_number_leaves_the_filter_as_it_was():
    rig = SpoiledRig(lambda r: r._replace(torque_nm=math.nan), 20)
    loop = ControlLoop(SETTINGS, rig, SimulatedClock(), lambda _: None)
    rig.enable()
    follow(loop, 1, [0.0] * 20, [0.0] * 20)
    before = loop.filtered
    follow(loop, 1, [0.0], [0.0])
    assert loop.cause is Cause.TORQUE_NOT_FINITE
    assert loop.filtered == before
    assert all(math.isfinite(value) for value in loop.filtered)
