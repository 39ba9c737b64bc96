"""The examples run as their docstrings say."""

import runpy
import sys
import time
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest
from typer.testing import CliRunner

from rigidimeter.cli.main import app
from rigidimeter.rig.acquisition import DeadlineClock
from rigidimeter.rig.devices import load_rig
from rigidimeter.rig.guard import Cause

EXAMPLES = Path(__file__).parents[2] / "examples"


def assert_steps_of_robot(robot: Any, count: int, limit_s: float = 10.0) -> None:
    """Wait for so many of its steps, each a millisecond where the processor is free."""
    last, until_s = robot.read()[0] + 2 * count, time.monotonic() + limit_s
    while robot.read()[0] < last:
        assert time.monotonic() < until_s
        time.sleep(0.005)


def run(name: str, argument: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", [name, str(argument)])
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")


@pytest.mark.usefixtures("no_figures")
def test_from_python_goes_from_design_to_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    example = runpy.run_path(str(EXAMPLES / "from_python.py"))
    for block in example["SETTINGS"]["protocol"]["blocks"]:
        block["epochs"] = 2  # of 3
    example["main"](tmp_path / "out")
    printed = capsys.readouterr().out
    stiffness = float(printed.split(", K ")[1].split()[0])
    assert stiffness == pytest.approx(1.751, rel=2e-3)  # [subject.OFF] by default
    assert (tmp_path / "out/report/report.html").exists()
    for name in ("perturbation.png", "estimates.png"):
        assert (tmp_path / "out" / name).read_bytes().startswith(b"\x89PNG")
    plt.close("all")


def test_filter_alike_shows_that_a_filter_on_the_position_alone_biases(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    session = tmp_path / "session"
    words = ["simulate", "--out", str(session), "--task", "prbs", "--epochs", "2"]
    assert CliRunner().invoke(app, words).exit_code == 0
    run("filter_alike.py", session, monkeypatch)
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    inertia_percent = {" ".join(row[:-4]): float(row[-4]) for row in rows}
    assert abs(inertia_percent["all four, zero phase"]) < 2.0
    assert abs(inertia_percent["position only, causal"]) > 10.0


@pytest.mark.realtime(resolves_s=0.02)
def test_a_robot_that_blocks_is_read_from_a_process_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sensor and drive share it, its stamps are on the loop's clock, and `disable` holds."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    file = tmp_path / "RIG.toml"
    file.write_text(
        '[torque_sensor]\ndriver = "robot_driver:RobotTorque"\n'
        '[drive]\ndriver = "robot_driver:RobotDrive"\n'
    )
    clock = DeadlineClock()
    time.sleep(0.1)  # its zero is not that of any other process
    rig = load_rig(file).build(clock.now_s, 250.0)
    try:
        rig.connect()
        rig.configure()
        (shared,) = sys.modules["robot_driver"].Connection.open_ones.values()
        assert shared.users == 2
        rig.enable()
        took_s, ages_s = [], []
        for _ in range(100):
            clock.wait_until(clock.now_s() + 0.004)
            began_s = time.perf_counter()
            reading = rig.read()
            rig.write(0.5)
            took_s.append(time.perf_counter() - began_s)
            ages_s.append(clock.now_s() - reading.torque_time_s)
        assert reading.cause == Cause.NONE
        assert sorted(took_s)[50] < 2e-4  # a wait of the robot is 1 ms
        assert -1e-3 < sorted(ages_s)[50] < 0.02
        assert reading.angle_rad > 0.1
        rig.disable()
        assert_steps_of_robot(shared, 100)  # its velocity falls with a time constant of 5
        assert not rig.powered
        held_rad = rig.read().angle_rad
        rig.write(0.5)
        assert_steps_of_robot(shared, 100)
        assert rig.read().angle_rad == pytest.approx(held_rad, abs=1e-6)
    finally:
        rig.close()
    assert not sys.modules["robot_driver"].Connection.open_ones
