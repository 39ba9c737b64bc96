"""The emulated sensor is one to a client that others wrote, and to nobody else."""

import socket
import struct
import time

import pytest
from tests.wire.rdt_wire import NOISE_NM, TORQUE_NM, arm, emulator, sensor_of

from rigidimeter.testing import RdtEmulator

__all__ = ["arm", "emulator", "sensor_of"]


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
