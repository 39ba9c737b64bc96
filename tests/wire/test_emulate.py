"""The lines of `rigidimeter emulate`, as people and tests use them."""

from __future__ import annotations

import importlib.util
import os
import signal
from pathlib import Path

import pytest

from rigidimeter.devices.rigfile import load_rig

pytest.importorskip("serial")

_spec = importlib.util.spec_from_file_location(
    "rig_process", Path(__file__).with_name("rig_process.py")
)
assert _spec is not None
assert _spec.loader is not None
_module = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_module)


def test_the_bench_answers_every_line_and_ends_in_order(tmp_path: Path) -> None:
    with _module.RigProcess(tmp_path / "RIG.toml", "ascii") as bench:
        assert load_rig(bench.rig).name == "emulated rig"
        assert bench.command("place 12")["ok"]
        state = bench.state()
        assert state["angle_rad"] == pytest.approx(0.2094, abs=1e-3)
        assert state["power"] is False
        assert bench.misbehave("drive", "runs away", 2.0)["misbehaves"] == "runs_away"
        assert bench.misbehave("torque", "lose", 3)["value"] == 3.0
        for line in ("nonsense", "misbehave", "misbehave drive nonsense", "place", "joint -1 0 0"):
            assert "error" in bench.command(line, refused=True)
        bench.command("press")
        assert bench.state()["pressed"] is True
        bench.behave()
        assert bench.state()["pressed"] is True  # a repaired rig is not a released button
        bench.command("release")
        assert bench.state()["pressed"] is False
        assert set(bench.command("help")) >= {"torque", "drive", "commands"}
        assert isinstance(bench.log(), list)
        process = bench._process
        os.kill(bench.pid, signal.SIGINT)
        assert process.wait(10.0) == 0
    assert bench._process is None


def test_a_bench_that_cannot_start_says_why(tmp_path: Path) -> None:
    with (
        pytest.raises(AssertionError, match=r"torque-rate-hz|rate_hz"),
        _module.RigProcess(tmp_path / "RIG.toml", "ascii", "--torque-rate-hz", "-1"),
    ):
        pass
