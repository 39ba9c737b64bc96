"""The loop compares the torque sensor with the drive's own torque, and a record is replayed so."""

import math

import numpy as np
import pytest
from tests.unit.rig.acquisition.test_replay import columns_of
from tests.unit.rig.acquisition.whole_session import ListSink

from rigidimeter.core.session import Sample
from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan, prbs_nm
from rigidimeter.rig.acquisition import (
    ControlLoop,
    SimulatedClock,
    hold,
    perturb,
    replay,
    run_session,
    zero_torque,
)
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.guard import Cause, DriveModel, Reaction

SETTINGS = parse_settings(
    {"prbs": {"duration_s": 4.0}, "protocol": {"blocks": [{"epochs": 1}], "rests_s": [0.6]}}
    | {"zeroing": {"duration_s": 0.5}}
)
SIDE = SETTINGS.rig.drive_side
MODEL = DriveModel(
    SIDE.torque_scale, 0.001, SIDE.reflected_inertia_kg_m2, SIDE.friction_nm, 0.0, 0.0, 0.03
)
"""As the settings have it; the scatter is about what commissioning finds."""

WRONG_FROM = 2500


def spoiled_rig(wrong, settings=SETTINGS):
    """Return a rig whose torque is another one from a tick on."""
    rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(3))
    read, ticks = rig.read, [0]

    def reading(elapsed=1):
        ticks[0] += elapsed
        sample = read(elapsed)
        return sample if ticks[0] < WRONG_FROM else sample._replace(torque_nm=wrong(sample))

    rig.read = reading
    return rig


def ran(wrong, model):
    rig, samples = spoiled_rig(wrong), []
    loop = ControlLoop(
        SETTINGS, rig, SimulatedClock(), samples.append, lambda _: None, drive_model=model
    )
    rig.enable()
    hold(loop, 1.0)
    perturb(loop, 1, prbs_nm(SETTINGS.prbs, SETTINGS.rig.tick_rate_hz).tolist())
    return loop, samples


def test_a_true_torque_passes():
    loop, _ = ran(lambda sample: sample.torque_nm, MODEL)
    assert loop.cause is Cause.NONE
    assert 0.01 < math.sqrt(loop.compared.steps.model_nm2) < 1.0


@pytest.mark.parametrize(
    "wrong",
    [
        lambda sample: sample.torque_nm + 0.8,
        lambda sample: sample.torque_nm - 0.8,
    ],
)
def test_a_false_torque_stops_the_rig_with_its_number(wrong):
    loop, samples = ran(wrong, MODEL)
    assert (loop.cause, loop.reaction) == (Cause.TORQUE_DISAGREES, Reaction.RAMP)
    found = loop.stop.found
    assert found.value > found.limit > 4.0 * MODEL.scatter_nm
    assert f"limit {found.limit:.4g} N·m" in loop.stop.sentence
    assert "rigidimeter check" in loop.stop.sentence
    assert samples[-1].cause == Cause.TORQUE_DISAGREES
    assert samples[-1].tick - WRONG_FROM < 2000


def test_without_a_model_nothing_is_compared():
    loop, _ = ran(lambda sample: sample.torque_nm + 0.8, None)
    assert loop.cause is not Cause.TORQUE_DISAGREES
    assert loop.compared.steps.settled_s == 0.0


def test_a_drive_that_no_longer_reports_its_torque_stops_the_rig_and_says_so():
    rig = spoiled_rig(lambda sample: sample.torque_nm)
    read, ticks = rig.read, [0]

    def reading(elapsed=1):
        ticks[0] += elapsed
        gone = {"drive_torque_nm": math.nan, "drive_torque_time_s": math.nan}
        return read(elapsed)._replace(**(gone if ticks[0] > 1000 else {}))

    rig.read = reading
    loop = ControlLoop(SETTINGS, rig, SimulatedClock(), lambda _: None, drive_model=MODEL)
    rig.enable()
    hold(loop, 2.0)
    assert loop.cause is Cause.TORQUE_DISAGREES
    assert loop.tick == pytest.approx(1500, abs=60)
    assert "0.5 s without the drive's torque" in loop.stop.sentence


def test_what_the_zeroing_took_off_is_taken_off_the_model():
    """A sensor that is off by 0.9 N·m as it was when the rig was commissioned is no fault."""
    rig = SimulatedRig(SETTINGS.rig, SETTINGS.subject["OFF"], np.random.default_rng(3))
    loop = ControlLoop(SETTINGS, rig, SimulatedClock(), lambda _: None, drive_model=MODEL)
    zero_torque(loop, 0.9)
    assert loop.torques.model.zero_nm == pytest.approx(-0.9)
    assert rig.read().torque_nm == pytest.approx(-0.9, abs=0.03)


def test_to_zero_a_sensor_that_is_off_stops_no_session():
    """Neither as it is zeroed, nor after it, on a drive without friction that would hide it."""
    settings = parse_settings(
        {"prbs": {"duration_s": 2.0}, "protocol": {"blocks": [{"epochs": 1}], "rests_s": [0.6]}}
        | {"zeroing": {"duration_s": 1.0}, "rig": {"drive_side": {"friction_nm": 0.0}}}
    )
    rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(3))
    read, sink = rig.read, ListSink()

    def reading(elapsed=1):
        sample = read(elapsed)
        return sample._replace(torque_nm=sample.torque_nm + 0.9)

    rig.read = reading
    result = run_session(
        plan(settings.protocol, settings.prbs, settings.sinusoid, 1),
        settings,
        rig,
        SimulatedClock(),
        sink,
        zero_first=True,
        drive_model=MODEL._replace(zero_nm=0.9, friction_nm=0.0),
    )
    assert sink.of("sensor_zeroed")[0]["bias_nm"] == pytest.approx(0.9, abs=0.01)
    assert (result.cause, result.reason) == (Cause.NONE, "")


def test_a_session_records_the_model_and_a_replay_finds_the_same():
    sink = ListSink()
    # The sensor is off by 0.6 N·m all the time, and was so when the rig was commissioned.
    rig = SimulatedRig(SETTINGS.rig, SETTINGS.subject["OFF"], np.random.default_rng(3))
    read, ticks = rig.read, [0]

    def reading(elapsed=1):
        ticks[0] += elapsed
        sample = read(elapsed)
        late = 0.8 if ticks[0] > WRONG_FROM else 0.0
        return sample._replace(torque_nm=sample.torque_nm + 0.6 + late)

    rig.read = reading
    result = run_session(
        plan(SETTINGS.protocol, SETTINGS.prbs, SETTINGS.sinusoid, 1),
        SETTINGS,
        rig,
        SimulatedClock(),
        sink,
        zero_first=True,
        drive_model=MODEL._replace(zero_nm=0.6),
    )
    assert result.cause is Cause.TORQUE_DISAGREES
    assert sink.of("sensor_zeroed")[0]["bias_nm"] == pytest.approx(0.6, abs=0.01)
    (model,) = sink.of("drive_model")
    assert DriveModel(*(model[name] for name in DriveModel._fields)).zero_nm == 0.6
    columns = columns_of(sink.samples)
    found = replay(SETTINGS, columns, sink.events, Sample._fields)
    assert [one.cause for one in found.found] == [Cause.TORQUE_DISAGREES]
    assert (found.differences, found.not_run) == ((), ())
    # Without the zeroing the difference would have been there from the start.
    unzeroed = [event for event in sink.events if event["event"] != "sensor_zeroed"]
    assert replay(SETTINGS, columns, unzeroed, Sample._fields).differences
    older = [name for name in Sample._fields if not name.startswith("drive_torque")]
    assert "not compared" in replay(SETTINGS, columns, sink.events, older).not_run[-1]
