import math
import struct

import pytest

from rigidimeter.rig.devices import (
    COUNTS,
    START_REALTIME,
    STOP,
    AtiRdt,
    RdtStream,
    request,
    status_words,
)
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause


class Sensor:
    """Packets at 1 kHz into a stream, with the time they arrive at."""

    def __init__(self, tolerated=3, window_s=1.0, frozen_s=0.1, first=1):
        self.stream = RdtStream(tolerated, window_s, frozen_s, 0.0)
        self.sequence, self.ft, self.now_s = first, 7 * first, 100.0
        self.counts = (0, 0, 0, 0, 0, 0)

    def send(self, *, sequence=None, ft=None, status=0, counts=None, data=None, begin=True):
        self.now_s += 0.001
        if sequence is None:
            sequence, self.sequence = self.sequence, self.sequence + 1
        if ft is None:
            ft, self.ft = self.ft, self.ft + 7
        if counts is None:
            counts = self.counts = (*self.counts[:5], self.counts[5] + 1)
        if data is None:
            header = (sequence & 0xFFFFFFFF, ft & 0xFFFFFFFF, status)
            data = struct.pack(">IIIiiiiii", *header, *counts)
        buffer = bytearray(64)
        buffer[: len(data)] = data
        if begin:
            self.stream.begin()
        self.stream.take(len(data), buffer, self.now_s)
        return self.cause

    @property
    def cause(self):
        return Cause(self.stream.cause(self.now_s))

    def counted(self):
        return {name: n for name, n in self.stream.counts.items() if n and name != "received"}


def test_requests_are_those_of_the_manual():
    assert request(STOP) == bytes.fromhex("1234 0000 00000000")
    assert request(START_REALTIME) == bytes.fromhex("1234 0002 00000000")


def test_a_record_is_big_endian_and_signed():
    sensor = Sensor()
    record = bytes.fromhex("00000001 00000007 00000000" + "ffffffff" * 5 + "80000000")
    sensor.send(data=record)
    assert COUNTS.unpack(sensor.stream.packed) == (-1, -1, -1, -1, -1, -(2**31))
    assert sensor.stream.sequence == 1


def test_every_status_bit_has_words_and_all_are_different():
    words = [status_words(1 << bit) for bit in range(32)]
    assert all(len(word) == 1 for word in words)
    assert len(set(words)) == 32
    assert status_words(0) == ()
    assert status_words(0x80010000) == ("an error (summary)", "monitored condition latched")


@pytest.mark.parametrize("bit", range(32))
def test_every_bit_but_the_warning_stops(bit):
    cause = Sensor().send(status=1 << bit)
    if bit == 16:
        assert cause is Cause.NONE
    else:
        assert cause is (Cause.TORQUE_SATURATED if bit == 17 else Cause.TORQUE_STATUS)


def test_a_warning_is_counted_and_no_more():
    sensor = Sensor()
    assert sensor.send(status=0x80010000) is Cause.NONE
    assert sensor.counted() == {"warnings": 1}


def test_a_status_is_not_lost_under_a_newer_packet():
    sensor = Sensor()
    sensor.send(status=0x80000020)
    assert sensor.send(begin=False) is Cause.TORQUE_STATUS
    assert sensor.send(status=0x80010000, begin=False) is Cause.TORQUE_STATUS
    assert sensor.stream.status == 0x80010020
    assert sensor.send() is Cause.NONE


def test_saturation_is_told_apart_from_frozen_and_from_another_error():
    sensor = Sensor()
    for _ in range(300):
        cause = sensor.send(status=0x80020020, counts=(1, 2, 3, 4, 5, 6))
    assert cause is Cause.TORQUE_SATURATED


def test_what_is_missing_is_counted_and_tolerated_so_often():
    sensor = Sensor(tolerated=3)
    sensor.send()
    sensor.sequence += 3
    assert sensor.send() is Cause.NONE
    sensor.sequence += 1
    assert sensor.send() is Cause.TORQUE_PACKETS
    assert sensor.counted() == {"lost": 4}


def test_bad_packets_are_forgotten_after_the_window():
    sensor = Sensor(tolerated=1, window_s=0.05)
    sensor.send()
    for _ in range(5):
        sensor.sequence += 1
        assert sensor.send() is Cause.NONE
        for _ in range(60):
            assert sensor.send() is Cause.NONE


def test_the_wrap_around_is_no_loss():
    sensor = Sensor(first=2**32 - 3)
    for _ in range(6):
        assert sensor.send() is Cause.NONE
    assert sensor.stream.sequence == 2
    assert sensor.counted() == {}


def test_a_loss_across_the_wrap_around_is_counted():
    sensor = Sensor(first=2**32 - 1)
    sensor.send()
    sensor.sequence += 2
    sensor.send()
    assert (sensor.stream.sequence, sensor.counted()) == (2, {"lost": 2})


def test_the_newest_wins_over_one_that_comes_late():
    sensor = Sensor()
    for sequence in (1, 3, 2):
        sensor.send(sequence=sequence, ft=7 * sequence, counts=(0, 0, 0, 0, 0, sequence))
    assert COUNTS.unpack(sensor.stream.packed)[5] == 3
    assert sensor.counted() == {"lost": 1, "reordered": 1}
    assert sensor.stream.sampled_s == pytest.approx(100.002)


def test_one_repeated_packet_is_a_bad_one_and_a_row_of_them_a_frozen_sensor():
    sensor = Sensor(tolerated=3)
    sensor.send()
    causes = [sensor.send(sequence=1, ft=7) for _ in range(200)]
    assert causes.index(Cause.TORQUE_FROZEN) == 100
    assert set(causes) == {Cause.NONE, Cause.TORQUE_FROZEN}
    assert sensor.stream.counts["repeated"] == 200


def test_packets_each_sent_twice_are_too_many_repeated():
    sensor = Sensor(tolerated=3)
    for k in range(1, 6):
        sensor.send(sequence=k, ft=7 * k)
        cause = sensor.send(sequence=k, ft=7 * k)
    assert cause is Cause.TORQUE_PACKETS


@pytest.mark.parametrize(
    "stuck", [{"ft": 7}, {"counts": (9, 9, 9, 9, 9, 9)}, {"sequence": 1}], ids=str
)
def test_whatever_stands_still_is_frozen(stuck):
    sensor = Sensor(frozen_s=0.1)
    causes = [sensor.send(**stuck) for _ in range(110)]
    assert causes[:100] == [Cause.NONE] * 100
    assert causes[-1] is Cause.TORQUE_FROZEN
    sensor.sequence, sensor.ft = sensor.sequence + 1, sensor.ft + 7
    assert sensor.send() is Cause.NONE  # it moves again


def test_a_sample_does_not_get_newer_while_the_ft_sequence_stands():
    sensor = Sensor()
    for _ in range(20):
        sensor.send(ft=7)
    assert sensor.stream.sampled_s == pytest.approx(100.001)


def test_silence_is_not_frozen():
    sensor = Sensor(frozen_s=0.1)
    sensor.send()
    sensor.send(sequence=1, ft=7)
    sensor.now_s += 10.0
    assert sensor.cause is Cause.NONE


@pytest.mark.parametrize("data", [b"", b"x" * 20, b"x" * 40])
def test_packets_of_another_length_are_not_used(data):
    sensor = Sensor(tolerated=3)
    sensor.send()
    before = sensor.stream.packed
    causes = [sensor.send(data=data) for _ in range(4)]
    assert causes == [Cause.NONE] * 3 + [Cause.TORQUE_PACKETS]
    assert sensor.stream.packed is before
    assert sensor.counted() == {"damaged": 4, "short": 4}


@pytest.mark.parametrize(
    ("sequence", "ft"), [(1_000_000, 7000), (2**31, 7000), (2, 2**32 - 5)], ids=str
)
def test_a_packet_that_cannot_be_is_not_used_nor_its_status(sequence, ft):
    sensor = Sensor()
    sensor.send()
    assert sensor.send(sequence=sequence, ft=ft, status=0x80000020) is Cause.NONE
    assert (sensor.stream.sequence, sensor.counted()) == (1, {"damaged": 1})


def test_a_sensor_that_restarts_is_not_taken_for_the_same_stream():
    sensor = Sensor(tolerated=3, first=5000)
    sensor.send()
    causes = [sensor.send(sequence=k, ft=7 * k) for k in range(1, 6)]
    assert causes[-1] is Cause.TORQUE_PACKETS
    assert sensor.stream.sequence == 5000


def test_weights_that_see_nothing_are_refused():
    with pytest.raises(ValueError, match="at least one axis"):
        AtiRdt.Settings(weights=[0.0] * 6)
    with pytest.raises(ValueError, match="weights"):
        AtiRdt.Settings(weights=[0.0, 0.0, 0.0, 0.0, 0.0, math.inf])
    with pytest.raises(ValueError, match="weights"):
        AtiRdt.Settings(weights=[1.0])


def test_the_sign_is_one_of_two():
    assert AtiRdt.Settings(sign=1).sign == 1
    with pytest.raises(ValueError, match="sign"):
        AtiRdt.Settings(sign=0)


def test_before_it_is_connected_a_sensor_has_no_torque_and_no_age():
    sensor = AtiRdt(AtiRdt.Settings(), lambda: 5.0)
    sample = sensor.read()
    assert math.isnan(sample.torque_nm)
    assert sample.time_s == -math.inf
    sensor.close()
    sensor.close()
    with pytest.raises(DeviceError, match="not connected"):
        sensor.configure()


def test_an_address_that_means_nothing_is_refused():
    sensor = AtiRdt(AtiRdt.Settings(address="no..such..sensor"), lambda: 5.0)
    with pytest.raises(DeviceError, match=r"no\.\.such"):
        sensor.connect()
