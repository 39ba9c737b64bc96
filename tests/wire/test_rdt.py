"""The sensor's driver against a sensor on a true wire, doing everything wrong in turn."""

import itertools
import time

import pytest
from tests.wire.rdt_wire import (
    NOISE_NM,
    TORQUE_NM,
    arm,
    bad_counts,
    emulator,
    first_cause,
    newest,
    sensor,
    sensor_of,
    watch,
)

from rigidimeter.rig.guard import Cause
from rigidimeter.testing import RDT_MISBEHAVIOURS, RdtEmulator

__all__ = ["arm", "emulator", "sensor", "sensor_of"]


def test_what_arrives_is_what_was_sent_to_the_count(emulator, sensor):
    samples = watch(sensor, 0.3)
    sent = dict(emulator.sent)
    assert len({sample.sequence for sample in samples}) > 50
    for sample in samples:
        assert sample.torque_nm == pytest.approx(sent[sample.sequence], abs=0.51e-6)
        assert sample.raw[5] == round(-sent[sample.sequence] * 1e6)
        assert sample.cause == Cause.NONE
    assert bad_counts(sensor) == {}


def test_the_torque_is_the_arms(arm, sensor):
    torques = [sample.torque_nm for sample in watch(sensor, 0.2)]
    assert sum(torques) / len(torques) == pytest.approx(TORQUE_NM, abs=NOISE_NM)


@pytest.mark.parametrize("unit", ["Nmm", "lbf-in", "lbf-ft", "N-m"])
def test_the_torque_does_not_depend_on_the_sensors_unit(arm, sensor_of, unit):
    with RdtEmulator(arm, torque_unit=unit, force_unit="lbf") as emulator:
        sensor = sensor_of(emulator)
        facts = sensor.configure()
        sample = watch(sensor, 0.03)[-1]
        assert sample.torque_nm == pytest.approx(dict(emulator.sent)[sample.sequence], abs=0.51e-6)
        assert facts.values["force_unit"] == "lbf"


@pytest.mark.parametrize("sign", [1, -1])
def test_lever_arms_weigh_the_forces(emulator, sensor_of, sign):
    sensor = sensor_of(emulator, weights=[0.25, 0.0, -0.5, 0.0, 1.0, 0.5], sign=sign)
    sensor.configure()
    for sample in watch(sensor, 0.02):
        fx, _, fz, _, ty, tz = (count / 1e6 for count in sample.raw)
        expected_nm = sign * (0.25 * fx - 0.5 * fz + ty + 0.5 * tz)
        assert sample.torque_nm == pytest.approx(expected_nm, abs=1e-12)


def test_configuring_waits_for_the_first_sample_and_closing_stops_the_stream(
    emulator, sensor, lateness
):
    sample = sensor.read()
    assert sample.sequence >= 1
    assert abs(time.monotonic() - sample.time_s) < 0.05 + lateness.worst_s(sample.time_s)
    sensor.close()
    sensor.close()
    time.sleep(0.05)
    sent = len(emulator.sent)
    time.sleep(0.05)
    assert len(emulator.sent) == sent
    assert emulator.requests[-1] == 0
    assert sensor.read().sequence == sample.sequence


def test_connecting_says_nothing_to_the_sensor(emulator, sensor_of):
    sensor_of(emulator)
    time.sleep(0.05)
    assert not emulator.requests


RUNNING = [
    ("frozen_sequence", None, Cause.TORQUE_FROZEN, "repeated"),
    ("frozen_ft_sequence", None, Cause.TORQUE_FROZEN, None),
    ("frozen_values", None, Cause.TORQUE_FROZEN, None),
    ("frozen_record", None, Cause.TORQUE_FROZEN, "repeated"),
    ("saturated", None, Cause.TORQUE_SATURATED, None),
    ("serious_status", None, Cause.TORQUE_STATUS, None),
    ("serious_status", 0x80000000, Cause.TORQUE_STATUS, None),
    ("one_bad_status", None, Cause.TORQUE_STATUS, None),
    ("warning", None, Cause.NONE, "warnings"),
    ("lose", None, Cause.TORQUE_PACKETS, "lost"),
    ("lose_once", 3, Cause.NONE, "lost"),
    ("lose_once", 6, Cause.TORQUE_PACKETS, "lost"),
    ("duplicate", None, Cause.TORQUE_PACKETS, "repeated"),
    ("duplicate", 1, Cause.TORQUE_PACKETS, "repeated"),
    ("duplicate_once", None, Cause.NONE, "repeated"),
    ("reorder", None, Cause.TORQUE_PACKETS, "reordered"),
    ("reorder_once", None, Cause.NONE, "reordered"),
    ("short", None, Cause.TORQUE_PACKETS, "short"),
    ("short", 1, Cause.TORQUE_PACKETS, "short"),
    ("long", None, Cause.TORQUE_PACKETS, "damaged"),
    ("garbage", None, Cause.TORQUE_PACKETS, "damaged"),
    ("garbage", 1, Cause.TORQUE_PACKETS, "damaged"),
    ("backlog", None, Cause.NONE, None),
    ("delay", None, Cause.NONE, None),
    ("lag", None, Cause.NONE, None),
    ("flood", None, Cause.TORQUE_PACKETS, "repeated"),
    ("restart", None, Cause.TORQUE_PACKETS, None),
    ("foreign", None, Cause.NONE, "foreign"),
    ("bias", None, Cause.NONE, None),
    ("spike", 20, Cause.NONE, None),
    ("gain", None, Cause.NONE, None),
    ("other_axis", None, Cause.NONE, None),
    ("toggles", None, Cause.NONE, None),
    ("axis_constant", None, Cause.NONE, None),
    ("late", 0.1, Cause.NONE, None),
    ("pauses", None, Cause.NONE, None),
    ("bursts", None, Cause.NONE, None),
    ("silent", None, Cause.NONE, None),
]


@pytest.mark.parametrize(("name", "value", "cause", "count"), RUNNING)
def test_a_fault_while_running_has_its_cause_and_is_counted(
    emulator, sensor, name, value, cause, count
):
    watch(sensor, 0.05)
    assert bad_counts(sensor) == {}
    emulator.misbehave(name, value)
    found, after_s = first_cause(sensor, 0.25 if cause is Cause.NONE else 2.0)
    assert found is cause
    if count is not None:
        assert sensor.counts[count] > 0
    if cause is Cause.TORQUE_FROZEN:
        assert after_s > 0.09


@pytest.mark.parametrize("name", ["lose", "duplicate", "reorder", "short", "garbage", "foreign"])
def test_a_damaged_stream_never_gives_a_torque_that_was_not_sent(emulator, sensor, name):
    emulator.misbehave(name, 2)
    samples = watch(sensor, 0.1)
    sent = dict(emulator.sent)
    for sample in samples:
        assert sample.torque_nm == pytest.approx(sent[sample.sequence], abs=0.51e-6)
    sequences = [sample.sequence for sample in samples]
    assert sequences == sorted(sequences)  # the newest wins


def test_silence_is_told_by_the_age_alone(emulator, sensor):
    watch(sensor, 0.02)
    emulator.misbehave("silent")
    time.sleep(0.02)
    last = sensor.read()
    time.sleep(0.1)
    after = sensor.read()
    assert after == last
    assert time.monotonic() - after.time_s > 0.09
    emulator.behave()
    emulator.misbehave("lose_once", 0)  # nothing lost: only the silence is
    time.sleep(0.05)
    # What the silence swallowed was numbered and is missed.
    assert sensor.read().cause == Cause.TORQUE_PACKETS


@pytest.mark.parametrize("name", ["frozen_sequence", "frozen_ft_sequence", "frozen_record"])
def test_a_sample_that_stands_still_ages_at_once(emulator, sensor, name):
    emulator.misbehave(name)
    samples = watch(sensor, 0.08)
    assert len({sample.time_s for sample in samples[20:]}) == 1


def test_a_backlog_gives_its_newest_and_no_loss(emulator, sensor):
    emulator.misbehave("backlog", 0.05)
    samples = watch(sensor, 0.3)
    times = sorted({sample.time_s for sample in samples})
    longest_s = max(b - a for a, b in itertools.pairwise(times))
    assert longest_s > 0.04
    assert sensor.counts["lost"] == 0
    assert all(sample.cause == Cause.NONE for sample in samples)


def test_a_loop_held_up_loses_nothing_at_7_khz(arm, sensor_of):
    with RdtEmulator(arm, rate_hz=7000.0) as emulator:
        sensor = sensor_of(emulator)
        sensor.configure()
        before = sensor.read()
        time.sleep(0.15)
        behind = sensor.read()
        assert behind.sequence > before.sequence
        assert behind.time_s == before.time_s  # newer ones wait: it is not fresh
        for _ in range(20):
            sensor.read()
        sample = sensor.read()
        assert sensor.counts["lost"] == 0
        assert sensor.counts["received"] > 500
        assert emulator.sent[-1][0] - sample.sequence < 200


@pytest.mark.parametrize("rate", [0.5, 0.1])
def test_samples_that_come_ever_later_are_as_old_as_they_are(emulator, sensor, lateness, rate):
    """They arrive without a gap, each at its time, and none is lost: only their numbers tell."""
    watch(sensor, 0.05)
    began_s = time.monotonic()
    emulator.misbehave("lag", rate)
    samples = watch(sensor, 0.5)
    passed_s = time.monotonic() - began_s
    age_s = time.monotonic() - samples[-1].time_s
    # A record that was on its way for d is one of those sent since the delay was d.
    grown_s = rate * passed_s
    within_s = 0.01 + lateness.worst_s(began_s)
    assert age_s == pytest.approx(grown_s, abs=within_s)
    assert bad_counts(sensor) == {}
    assert all(sample.cause == Cause.NONE for sample in samples)


def test_a_loop_that_stood_still_is_not_told_that_its_samples_are_old(emulator, sensor, lateness):
    """The packets that waited are older each by what it waited, and the newest is fresh."""
    watch(sensor, 0.1)
    began_s = time.monotonic()
    # Less, and more, than the stamps are trusted for; fewer packets than one read takes (256).
    for pause_s in (0.15, 0.22):
        time.sleep(pause_s)
        assert time.monotonic() - sensor.read().time_s < 0.01 + lateness.worst_s(began_s)
    times = [sample.time_s for sample in watch(sensor, 0.1)]
    assert times == sorted(times)
    assert time.monotonic() - times[-1] < 0.01 + lateness.worst_s(began_s)


def test_a_read_ends_whatever_arrives(emulator, sensor):
    emulator.misbehave("flood", 2000)
    time.sleep(0.05)
    emulator.misbehave("silent")
    received = sensor.counts["received"]
    sensor.read()
    assert sensor.counts["received"] - received <= 256


def test_a_bias_under_load_and_a_spike_pass_to_the_guard(emulator, sensor):
    emulator.misbehave("bias", 3.0)
    time.sleep(0.02)
    assert newest(watch(sensor, 0.02)) == pytest.approx(TORQUE_NM + 3.0, abs=10 * NOISE_NM)
    emulator.behave()
    emulator.misbehave("spike", 2)
    time.sleep(0.02)
    assert max(sample.torque_nm for sample in watch(sensor, 0.05)) > 45.0


@pytest.mark.parametrize(
    ("name", "value", "gain"), [("gain", -1.0, -1.0), ("gain", 0.5, 0.5), ("other_axis", None, 0.0)]
)
def test_a_wrong_gain_and_another_axis_pass_unnoticed(emulator, sensor, name, value, gain):
    emulator.misbehave(name, value)
    time.sleep(0.02)
    samples = watch(sensor, 0.02)
    assert newest(samples) == pytest.approx(gain * TORQUE_NM, abs=10 * NOISE_NM)
    assert len({sample.torque_nm for sample in samples}) > 1


def test_the_sequence_wraps_around_without_loss(arm, sensor_of):
    with RdtEmulator(arm, first_sequence=2**32 - 40) as emulator:
        sensor = sensor_of(emulator)
        sensor.configure()
        samples = watch(sensor, 0.2)
        assert samples[-1].sequence < 1000
        assert bad_counts(sensor) == {}


def test_every_misbehaviour_is_tried():
    elsewhere = {"changed_units", "changed_calibration", "changed_bias"}
    pages = {"unknown_units", "rdt_disabled", "page_status", "page_rate", "deaf"}
    http = {name for name in RDT_MISBEHAVIOURS if name.startswith("http_")}
    assert {name for name, *_ in RUNNING} | elsewhere | pages | http == set(RDT_MISBEHAVIOURS)


WITHHOLDS = {"silent", "deaf", "backlog", "restart", "frozen_record"}
WITHHOLDS |= {"delay", "lag", "pauses", "bursts"}
"""With these no record, or none with the other faults, arrives in time."""


def test_everything_at_once_stops_and_the_emulator_lives_on(emulator, sensor):
    for name in RDT_MISBEHAVIOURS:
        if name not in WITHHOLDS:
            emulator.misbehave(name, None if name.startswith("http") else 3)
    assert first_cause(sensor)[0] in (Cause.TORQUE_STATUS, Cause.TORQUE_SATURATED)
    emulator.behave()
    sensor.connect()
    sensor.configure()
    assert all(sample.cause == Cause.NONE for sample in watch(sensor, 0.05))


def test_two_faults_at_once_show_the_graver(emulator, sensor):
    emulator.misbehave("lose", 2)
    emulator.misbehave("frozen_values")
    emulator.misbehave("saturated")
    assert first_cause(sensor)[0] is Cause.TORQUE_SATURATED
    assert all(sample.cause == Cause.TORQUE_SATURATED for sample in watch(sensor, 0.2))


def test_a_wall_clock_that_jumps_has_no_effect(emulator, sensor, monkeypatch):
    monkeypatch.setattr(time, "time", lambda: 0.0)
    assert all(sample.cause == Cause.NONE for sample in watch(sensor, 0.1))


def test_a_wire_that_is_taken_away_does_not_raise(emulator, sensor):
    sensor._socket.close()  # as a network interface that goes down
    before = sensor.read()
    causes = [sensor.read().cause for _ in range(10)]
    assert causes[-1] == Cause.TORQUE_PACKETS
    assert sensor.read().time_s == before.time_s
    sensor.close()
