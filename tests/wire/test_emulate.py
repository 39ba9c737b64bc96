"""The lines of `rigidimeter emulate`, as people and tests use them."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest
from tests.wire.rig_process import RigProcess

from rigidimeter.rig.devices import load_rig

pytest.importorskip("serial")


def test_the_rig_answers_every_line_and_ends_in_order(tmp_path: Path) -> None:
    with RigProcess(tmp_path / "RIG.toml", "ascii") as rig:
        assert load_rig(rig.rig).name == "emulated rig"
        assert rig.command("place 12")["ok"]
        state = rig.state()
        assert state["angle_rad"] == pytest.approx(0.2094, abs=1e-3)
        assert state["power"] is False
        assert rig.misbehave("drive", "runs away", 2.0)["misbehaves"] == "runs_away"
        assert rig.misbehave("torque", "lose", 3)["value"] == 3.0
        for line in ("nonsense", "misbehave", "misbehave drive nonsense", "place", "joint -1 0 0"):
            assert "error" in rig.command(line, refused=True)
        rig.command("press")
        assert rig.state()["pressed"] is True
        rig.behave()
        assert rig.state()["pressed"] is True  # a repaired rig is not a released button
        rig.command("release")
        assert rig.state()["pressed"] is False
        assert set(rig.command("help")) >= {"torque", "drive", "commands"}
        assert isinstance(rig.log(), list)
        process = rig._process
        os.kill(rig.pid, signal.SIGINT)
        assert process.wait(10.0) == 0
    assert rig._process is None


def test_a_rig_that_cannot_start_says_why(tmp_path: Path) -> None:
    with (
        pytest.raises(AssertionError, match=r"torque-rate-hz|rate_hz"),
        RigProcess(tmp_path / "RIG.toml", "ascii", "--torque-rate-hz", "-1"),
    ):
        pass


def test_motor_and_gear_are_those_of_the_settings(tmp_path: Path) -> None:
    settings = tmp_path / "settings.toml"
    settings.write_text("[rig.drive_side]\nrated_torque_nm = 50.0\nfriction_nm = 3.0\n")
    with RigProcess(tmp_path / "RIG.toml", "cia402", "--settings", str(settings)) as emulated:
        rig = load_rig(emulated.rig).build(time.monotonic, 100.0)
        try:
            rig.connect()
            facts = rig.configure()["drive"]["values"]
        finally:
            rig.close()
    assert facts["rated_torque_nm"] == pytest.approx(50.0)
