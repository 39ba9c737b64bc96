"""The sensor's driver against a sensor on a true wire, doing everything wrong in turn."""

import itertools
import socket
import struct
import time

import pytest

from rigidimeter.devices.ati.rdt import AtiRdt
from rigidimeter.devices.base import DeviceError
from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.emulation.emulated_arm import EmulatedArm
from rigidimeter.emulation.rdt.rdt_emulator import MISBEHAVIOURS, RdtEmulator
from rigidimeter.guard import Cause

ANGLE_RAD = 0.3
STIFFNESS_NM_RAD = 2.0
TORQUE_NM = STIFFNESS_NM_RAD * ANGLE_RAD
NOISE_NM = 0.005


@pytest.fixture
def arm():
    arm = EmulatedArm(JointDynamics(0.08, 0.8, STIFFNESS_NM_RAD), noise_sd_nm=NOISE_NM)
    arm.place(ANGLE_RAD)
    return arm


@pytest.fixture
def emulator(arm):
    with RdtEmulator(arm) as emulator:
        yield emulator


@pytest.fixture
def sensor_of():
    """Make a driver of an emulator; all are closed in the end."""
    made = []

    def make(emulator, now=time.monotonic, **settings):
        # A busy machine may hold a thread up for longer than a real sensor ever is.
        values = {"timeout_s": 1.0, "tolerated_packets": 5, "frozen_s": 0.1, **settings}
        sensor = AtiRdt(
            AtiRdt.Settings(
                address="127.0.0.1", port=emulator.port, http_port=emulator.http_port, **values
            ),
            now,
        )
        made.append(sensor)
        sensor.connect()
        return sensor

    yield make
    for sensor in made:
        sensor.close()


@pytest.fixture
def sensor(emulator, sensor_of):
    sensor = sensor_of(emulator)
    sensor.configure()
    return sensor


def watch(sensor, duration_s):
    """Read at 1 kHz; return the samples."""
    samples = []
    until_s = time.monotonic() + duration_s
    while time.monotonic() < until_s:
        samples.append(sensor.read())
        time.sleep(0.001)
    return samples


def first_cause(sensor, within_s=2.0):
    """Read at 1 kHz until there is a cause; return it with the time that took."""
    start_s = time.monotonic()
    while (elapsed_s := time.monotonic() - start_s) < within_s:
        cause = sensor.read().cause
        if cause:
            return Cause(cause), elapsed_s
        time.sleep(0.001)
    return Cause.NONE, elapsed_s


def newest(samples):
    return samples[-1].torque_nm


def bad_counts(sensor):
    return {name: n for name, n in sensor.counts.items() if n and name != "received"}


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


def test_what_the_sensor_says_of_itself_is_kept(emulator, sensor_of):
    facts = sensor_of(emulator).configure()
    assert (facts.model, facts.serial) == ("Emulated Net F/T", "FT00001")
    assert facts.fastest_tick_rate_hz == 1000.0
    assert facts.values["counts_per_torque"] == 1e6
    assert facts.values["torque_unit"] == "Nm"


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
    for pause_s in (0.15, 0.25):  # less, and more, than what the kernel's stamps are trusted for
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


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("unknown_units", None, "scfgtu.*'cubit-stone'.*Nm, Nmm"),
        ("rdt_disabled", None, "comrdte.*'Disabled'"),
        ("page_status", None, "analog board supply too low"),
        ("http_silent", None, "no answer within 0.3 s"),
        ("http_slow", 1.0, "no answer within 0.3 s"),
        ("http_drip", 0.05, "does not end within 0.3 s"),
        ("http_error", None, "answers 500"),
        ("http_garbage", None, "not the page of a Net F/T"),
        ("deaf", None, "no sample from 127.0.0.1"),
        ("silent", None, "no sample from 127.0.0.1"),
        ("delay", 0.15, r"the first sample came 0\.1\d s after each request, not .* within 0\.1 s"),
        ("delay", 1.0, "no sample from 127.0.0.1"),
        ("short", 1, "no sample.*'short': [1-9]"),
        ("foreign", None, None),
        ("serious_status", None, "analog board supply too low"),
        ("saturated", None, "saturated"),
    ],
)
def test_a_sensor_that_cannot_be_used_is_refused(emulator, sensor_of, lateness, name, value, words):
    emulator.misbehave(name, value)
    sensor = sensor_of(emulator, timeout_s=0.8 if name == "delay" else 0.3)
    if words is None:
        sensor.configure()
        return
    began_s = time.monotonic()
    with pytest.raises(DeviceError, match=words) as refused:
        sensor.configure()
    assert str(refused.value).startswith("torque sensor at 127.0.0.1: ")
    assert time.monotonic() - began_s < 1.0 + lateness.worst_s(began_s)
    emulator.behave()
    sensor.configure()  # and it can be used when it is right again


def test_every_misbehaviour_is_tried():
    elsewhere = {"changed_units", "changed_calibration", "changed_bias"}
    pages = {"unknown_units", "rdt_disabled", "page_status", "deaf"}
    http = {name for name in MISBEHAVIOURS if name.startswith("http_")}
    assert {name for name, *_ in RUNNING} | elsewhere | pages | http == set(MISBEHAVIOURS)


def test_no_web_server_and_no_sensor_are_refused(arm, sensor_of):
    with RdtEmulator(arm) as emulator:
        pass
    sensor = sensor_of(emulator, timeout_s=0.3)
    with pytest.raises(DeviceError, match=r"no answer.*check the sensor's power"):
        sensor.configure()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("changed_units", "torque_unit 'Nm' became 'lbf-in'"),
        ("changed_calibration", "serial 'FT00001' became 'FT99999', calibration 0 became 7"),
        ("changed_bias", "bias"),
    ],
)
def test_a_sensor_that_comes_back_changed_is_refused(emulator, sensor_of, sensor, name, words):
    sensor.close()
    emulator.misbehave(name)
    sensor.connect()
    with pytest.raises(DeviceError, match=f"came back changed.*{words}"):
        sensor.configure()
    sensor_of(emulator).configure()  # a new session looks at it with fresh eyes
    emulator.behave()
    sensor.connect()
    sensor.configure()
    assert sensor.read().cause == Cause.NONE


def test_a_sensor_that_was_refused_is_not_started_again(emulator, sensor):
    """Enabling a rig asks for the samples anew; that must not pass by what configuring found."""
    sensor.restart()  # as it is, it may
    assert sensor.read().sequence >= 0
    sensor.close()
    emulator.misbehave("changed_units")
    sensor.connect()
    with pytest.raises(DeviceError, match="came back changed"):
        sensor.configure()
    asked = len(emulator.requests)
    with pytest.raises(DeviceError, match="it is not configured; configure it first"):
        sensor.restart()
    assert len(emulator.requests) == asked
    assert sensor.read().sequence < 0
    emulator.behave()
    with pytest.raises(DeviceError, match="it is not configured"):  # well again, not looked at
        sensor.restart()
    sensor.configure()
    sensor.restart()
    assert sensor.read().cause == Cause.NONE


def test_a_sensor_that_gave_no_sample_is_not_started_again(emulator, sensor_of):
    sensor = sensor_of(emulator)
    emulator.misbehave("deaf")
    for _ in range(2):
        with pytest.raises(DeviceError, match="no sample"):
            sensor.configure()
        with pytest.raises(DeviceError, match="it is not configured"):
            sensor.restart()


@pytest.mark.parametrize(
    ("expected", "words"),
    [
        ({"expected_serial": "FT2"}, "serial is 'FT00001' where expected_serial is 'FT2'"),
        ({"expected_calibration": 3}, "calibration is 0 where"),
        ({"expected_torque_unit": "Nmm"}, "torque_unit is 'Nm' where"),
        ({"expected_force_unit": "lbf"}, "force_unit is 'N' where"),
        ({"expected_rate_hz": 7000.0}, "rate_hz is 1000.0 where"),
    ],
)
def test_a_sensor_that_is_not_the_expected_one_is_refused(emulator, sensor_of, expected, words):
    sensor = sensor_of(emulator, **expected)
    with pytest.raises(DeviceError, match=words):
        sensor.configure()
    assert not emulator.requests  # it was never asked to send


def test_the_expected_sensor_is_taken_however_its_unit_is_spelled(emulator, sensor_of):
    sensor_of(
        emulator, expected_serial="FT00001", expected_calibration=0, expected_torque_unit="N-m"
    ).configure()


WITHHOLDS = {"silent", "deaf", "backlog", "restart", "frozen_record"}
WITHHOLDS |= {"delay", "lag", "pauses", "bursts"}
"""With these no record, or none with the other faults, arrives in time."""


def test_everything_at_once_stops_and_the_emulator_lives_on(emulator, sensor):
    for name in MISBEHAVIOURS:
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


def test_the_emulator_ignores_what_is_no_request(emulator):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for data in (b"", b"x" * 8, struct.pack(">HHI", 0x4321, 2, 0), b"x" * 60):
            stranger.sendto(data, ("127.0.0.1", emulator.port))
    time.sleep(0.05)
    assert not emulator.requests
    assert not emulator.sent
    with pytest.raises(ValueError, match="no misbehaviour"):
        emulator.misbehave("sulk")


@pytest.mark.parametrize("unit", ["Nm", "Nmm"])
def test_a_client_that_others_wrote_sees_the_same_torque(arm, sensor_of, unit):
    pynetft = pytest.importorskip("pynetft")
    to_nm = {"N-m": 1.0, "N-mm": 1e-3}
    with RdtEmulator(arm, torque_unit=unit) as theirs, RdtEmulator(arm, seed=2) as emulator:
        config = pynetft.Config(
            sensor_host="127.0.0.1", rdt_port=theirs.port, http_port=theirs.http_port
        )
        sensor = sensor_of(emulator)
        sensor.configure()
        ours, seen = [], []
        with pynetft.Client(config, queue_size=1000) as client:
            for sample in client.samples(timeout=2.0):
                scale = to_nm[sample.torque_unit.value]
                seen.append((sample.rdt_sequence, -sample.torque[2] * scale))
                ours.append(sensor.read().torque_nm)
                if len(seen) == 200:
                    break
            health = client.health()
        sent = dict(theirs.sent)
        for sequence, torque_nm in seen:
            assert torque_nm == pytest.approx(sent[sequence], abs=0.51e-6)
        mean, their_mean = sum(ours) / 200, sum(torque for _, torque in seen) / 200
        assert their_mean == pytest.approx(TORQUE_NM, abs=NOISE_NM)
        assert mean == pytest.approx(their_mean, abs=NOISE_NM)
        assert (health.lost_count, health.malformed_count, health.device_error_count) == (0, 0, 0)
