"""A rig on its own wires, from a rig nobody has checked to an emergency stop, on the page."""

from __future__ import annotations

import subprocess
import sys

import pytest
from playwright.sync_api import expect
from tests.console.opened import Console, fill, open_page
from tests.console.operator_day import in_epoch, over
from tests.wire.rig_process import RigProcess

PROTOCOL = """
rig = {tick_rate_hz = 250.0, torque = {rate_hz = 250.0}, motion = {rate_hz = 250.0}}
guard = {reaction_time_s = 0.15, stale_s = 0.3, speed_limit_deg_s = 150.0}
loop = {missed_in_a_row = 50, stall_s = 0.09}
prbs.duration_s = 8.0
zeroing.duration_s = 1.0
commissioning = {daily_rest_s = 1.0, daily_motion_s = 3.0}
protocol.rests_s = [2.0]
protocol.return_s = 1.0
protocol.blocks = [{task = "prbs", condition = "OFF", epochs = 2}]
"""
BENCH_JOINT, ARM = "joint 0.002 0 0", "joint 0.07 0.3 5"


@pytest.fixture
def desk(tmp_path):
    """A console at the emulated RDT sensor and CANopen drive."""
    rig_file = tmp_path / "RIG.toml"
    with RigProcess(rig_file, "cia402") as rig:
        console = Console(tmp_path, "--rig", str(rig_file), protocol=PROTOCOL)
        yield console, rig
        console.close()


def commission(place) -> None:
    options = ("--rig", str(place / "RIG.toml"), "--settings", str(place / "protocol.toml"))
    done = subprocess.run(
        [sys.executable, "-m", "rigidimeter", "commission", *options, "--yes"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_a_wire_rig_is_commissioned_checked_run_and_stopped(desk, chromium):
    console, rig = desk
    page = open_page(chromium, console)
    start = page.get_by_role("button", name="Start session")
    fill(page, "subject", "S01")
    fill(page, "operator", "Op")
    expect(page.get_by_text("Rig: RIG.toml. Protocol: protocol.toml.")).to_be_visible()
    expect(page.get_by_text("No session can start")).to_contain_text("commission")
    expect(start).to_be_disabled()

    commission(console.place)
    rig.command(BENCH_JOINT)
    page.get_by_role("button", name="Check the rig").click()
    page.get_by_role("button", name="Yes, go on").click()
    page.get_by_role("button", name="Stop the check").wait_for(state="hidden", timeout=60e3)
    # Enabled by what the check found, not by the next look at the files, 5 s later.
    expect(start).to_be_enabled(timeout=1e3)
    expect(page.get_by_text("No session can start")).to_have_count(0)

    rig.command(ARM)
    page.get_by_role("button", name="Read zero and noise").click()
    expect(page.locator(".step.ok")).to_have_count(3, timeout=60e3)

    start.click()
    in_epoch(page, "1 of 2")
    in_epoch(page, "2 of 2")
    page.wait_for_timeout(1e3)
    assert abs(rig.state()["velocity_rad_s"]) < 3.0
    page.locator("#emergency").click()
    assert "emergency stop" in over(page, "fail")
    first, second = (e for e in console.events() if e["event"] == "epoch_ended")
    assert first["reason"] == ""
    assert first["missed_ticks"] < 25  # of 2000; 29 at once stopped the rig
    assert "emergency stop" in second["reason"]
    rig.wait_until(lambda state: abs(state["velocity_rad_s"]) < 0.01)
