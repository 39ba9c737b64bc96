"""The contact in the enable circuit opens whether or not the drive still answers."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path

import pytest
from tests.wire.rig_process import RigProcess

from rigidimeter.rig.devices import ComposedRig, load_rig
from rigidimeter.rig.guard import Cause

pytest.importorskip("serial")
pytest.importorskip("can")


class Line:
    """A contact that notes when it opens."""

    def __init__(self) -> None:
        self.closed = False
        self.opened_s: list[float] = []

    def close_contact(self) -> None:
        self.closed = True

    def open_contact(self) -> None:
        if self.closed:
            self.opened_s.append(time.monotonic())
        self.closed = False

    def close(self) -> None:
        self.open_contact()


def _runs(rig: ComposedRig, for_s: float) -> None:
    end_s = time.monotonic() + for_s
    while time.monotonic() < end_s:
        reading = rig.read()
        assert Cause(reading.cause) is Cause.NONE
        rig.write(0.3)
        time.sleep(0.004)


@pytest.mark.parametrize("kind", ["ascii", "cia402"])
def test_the_contact_opens_before_a_frozen_drive_is_told(kind: str, tmp_path: Path, lateness):
    """A serial drive is waited for, 0.2 s here; the contact is not."""
    with RigProcess(tmp_path / "RIG.toml", kind) as bench:
        devices = load_rig(bench.rig).devices
        sensor, drive = (
            devices[role][0](devices[role][1], time.monotonic)
            for role in ("torque_sensor", "drive")
        )
        line = Line()
        rig = ComposedRig(sensor, drive, 50.0, line)
        try:
            rig.connect()
            rig.configure()
            rig.enable()
            _runs(rig, 0.3)
            assert line.closed
            os.kill(bench.pid, signal.SIGSTOP)  # drive and sensor, at the other end of the wires
            frozen_s = time.monotonic()
            # The supervising process would end one that waits; a thread stands for it here.
            ending = threading.Thread(target=rig.disable)
            ending.start()
            ending.join(10.0)
            took_s = time.monotonic() - frozen_s
        finally:
            os.kill(bench.pid, signal.SIGCONT)
            rig.close()
        assert len(line.opened_s) == 1
        opened_s = line.opened_s[0] - frozen_s
        print(f"\n{kind}: contact open after {1e3 * opened_s:.1f} ms, disabled {took_s:.3f} s")
        assert opened_s < 0.02 + lateness.worst_s(frozen_s)
        if kind == "ascii":
            assert took_s > 0.15  # the drive was waited for, and did not answer
