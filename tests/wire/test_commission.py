"""Commissioning over true wires, in real time, against the emulated rig."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.wire.rig_process import RigProcess
from tests.wire.trial_setup import settings, setup

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import CommissioningSettings, Settings
from rigidimeter.rig.acquisition import DeadlineClock
from rigidimeter.rig.commissioning import (
    A_PERSON_TELLS,
    CommissioningRecord,
    Operator,
    check_record,
    commission_rig,
    read_record,
    record_path,
    write_record,
)
from rigidimeter.rig.devices import LOST, load_rig

pytest.importorskip("can")
pytest.importorskip("canopen")
pytest.importorskip("serial")

QUICK = CommissioningSettings(
    idle_s=0.6, swings=1, swing_speed_deg_s=20.0, steps_s=1.2, known_torque_s=0.5
)


@pytest.fixture(scope="module")
def can_bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with RigProcess(tmp_path_factory.mktemp("can") / "RIG.toml") as bench:
        yield bench


@pytest.fixture(autouse=True)
def _behaving(request: pytest.FixtureRequest) -> Iterator[None]:
    yield
    if "can_bench" in request.fixturenames:
        bench = request.getfixturevalue("can_bench")
        bench.behave()
        for line in ("release", "push 0", "place 0"):  # also where a test failed half-way
            bench.command(line)


def tried(
    rig: Path,
    chosen: Settings,
    ask: Callable[[str], bool] = lambda _: True,
    **operator: Any,
) -> tuple[CommissioningRecord, list[str]]:
    rigfile, chosen = load_rig(rig), chosen.model_copy(update={"commissioning": QUICK})
    record = commission_rig(
        setup(rigfile, chosen, Operator(ask=ask, **{"present": False, **operator})),
        rigfile,
        made_utc="2026-01-01T00:00:00+00:00",
        software="0",
    )
    return record, [check.name for check in record.failed]


def changed(rig: Path, tmp_path: Path, old: str, new: str) -> Path:
    text = rig.read_text()
    assert old in text
    other = tmp_path / "RIG.toml"
    other.write_text(text.replace(old, new))
    return other


def test_a_healthy_can_rig_passes_with_an_operator(can_bench: Any) -> None:
    def ask(question: str) -> bool:
        if "turn the joint by" in question:
            can_bench.command("place 10")
        elif question.startswith("Turn it back"):
            can_bench.command("place 0")
        elif question.startswith("Put a torque"):
            can_bench.command("push 2")
        elif question.startswith("Take the torque off"):
            can_bench.command("push 0")
        elif question.startswith("Emergency stop"):
            threading.Timer(1.5, lambda: can_bench.command("press")).start()
        elif question.startswith("Release"):
            can_bench.command("release")
        assert can_bench.state()["power"] is False
        return True

    chosen = settings(250.0)
    record, failed = tried(
        can_bench.rig, chosen, ask, present=True, known_torque_nm=2.0, known_angle_deg=10.0
    )
    assert failed == []
    assert record.passed
    assert record.not_tried == ()
    shown = {c.name: c.words for c in record.checks if c.name.startswith("bound of")}
    print(f"\n{shown}")
    enough = shown.pop("bound of the torque above a quick stop's")
    assert enough
    assert list(shown) == [f"bound of the {name}" for name in LOST]
    assert record.numbers["angle_per_command"] == pytest.approx(1.0, abs=0.02)
    assert record.numbers["bandwidth_hz"] == pytest.approx(50.0, rel=0.3)
    assert 0.0 <= record.numbers["torque_delay_s"] < 0.03
    state = can_bench.state()
    assert state["power"] is False
    assert abs(state["angle_rad"]) < 0.01
    _holds_for_this_rig_only(can_bench, chosen, record)


def _holds_for_this_rig_only(bench: Any, chosen: Settings, record: CommissioningRecord) -> None:
    rigfile = load_rig(bench.rig)
    write_record(record_path(rigfile.path), record)
    clock = DeadlineClock()
    rig = rigfile.build(clock.now_s, chosen.rig.tick_rate_hz)
    try:
        rig.connect()
        facts = rig.configure()
    finally:
        rig.close()
    from datetime import UTC, datetime

    today = datetime(2026, 1, 2, tzinfo=UTC)
    assert check_record(rigfile, facts, chosen, now_utc=today).passed
    with pytest.raises(UserError, match="tick_rate_hz"):
        check_record(rigfile, facts, settings(125.0), now_utc=today)


@pytest.mark.slow  # always: the CAN rig above, and the serial drive in `test_conformance`
def test_a_healthy_serial_rig_passes_at_a_low_tick_rate(tmp_path: Path) -> None:
    with RigProcess(tmp_path / "RIG.toml", "ascii") as bench:
        record, failed = tried(bench.rig, settings(60.0))
        assert failed == []
        assert record.passed
        assert {"watchdog reported", *A_PERSON_TELLS} <= set(record.not_tried)
        assert bench.state()["power"] is False


def test_a_drive_that_brakes_slower_than_the_guard_counts_on_is_caught(
    can_bench: Any, tmp_path: Path
) -> None:
    """1500 deg/s² are 26 rad/s²; the drive is asked what it took, not the rig file."""
    old = "deceleration_rad_s2 = 150.0"
    rig = changed(can_bench.rig, tmp_path, old, "deceleration_rad_s2 = 20.0")
    record, failed = tried(rig, settings(250.0))
    assert failed == ["braking of the drive"]
    assert record.failed[0].value == pytest.approx(math.degrees(20.0), rel=1e-3)


@pytest.mark.slow  # the checks themselves, with these faults, are tested on a simulated clock
def test_a_torque_of_the_wrong_sign_is_caught(can_bench: Any, tmp_path: Path) -> None:
    rig = changed(can_bench.rig, tmp_path, '"ati-rdt"', '"ati-rdt"\nsign = 1')
    _, failed = tried(rig, settings(250.0))
    assert failed == ["torque against motion"]


def test_bounds_that_sleep_are_written_and_not_shown(can_bench: Any) -> None:
    can_bench.misbehave("drive", "bound sleeps", 0x607D)
    record, failed = tried(can_bench.rig, settings(250.0))
    assert failed == []
    checks = {c.name: c for c in record.checks if c.name.startswith("bound of")}
    assert [name for name, c in checks.items() if not c.passed] == ["bound of the position"]
    assert checks["bound of the position"].words == "written, not shown"
    assert "bound of the position" in record.not_tried
    assert abs(can_bench.state()["angle_rad"]) < 0.01


def test_an_angle_of_the_wrong_sign_is_caught(can_bench: Any) -> None:
    before_rad = can_bench.state()["angle_rad"]
    can_bench.misbehave("drive", "encoder sign")
    _, failed = tried(can_bench.rig, settings(250.0))
    assert failed == ["angle per command"]
    assert abs(can_bench.state()["angle_rad"] - before_rad) < 0.02


@pytest.mark.slow
def test_wrong_counts_are_caught_by_the_nudge(can_bench: Any, tmp_path: Path) -> None:
    rig = changed(can_bench.rig, tmp_path, '"cia402"', '"cia402"\ncounts_per_rev = 142.98')
    _, failed = tried(rig, settings(250.0))
    assert failed == ["angle per command"]


def test_a_drive_that_keeps_another_watchdog_is_caught(can_bench: Any) -> None:
    can_bench.misbehave("drive", "wrong watchdog")
    record, failed = tried(can_bench.rig, settings(250.0))
    assert failed == ["devices read back"]
    assert "heartbeat watchdog" in record.failed[0].sentence


def test_a_dead_sensor_is_caught_and_the_record_says_so(
    can_bench: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from rigidimeter.cli.commission import commission as command

    # What it asks of the system would last for the tests after it.
    monkeypatch.setattr(
        "rigidimeter.cli.rig_checks.prepare_loop_process", lambda: SimpleNamespace()
    )
    can_bench.misbehave("torque", "silent")
    out = can_bench.rig.with_name("dead.json")
    with pytest.raises(UserError, match="not fit for a person: a check failed: devices read back"):
        command(can_bench.rig, None, "A. Weber", True, None, None, out, None, again=False)
    assert "FAIL" in capsys.readouterr().out
    record = read_record(out)
    assert record.signed_by == "A. Weber"
    assert not record.passed


def test_a_slow_and_noisy_sensor_is_caught(tmp_path: Path) -> None:
    options = ("--torque-rate-hz", "250", "--noise-nm", "0.4")
    with RigProcess(tmp_path / "RIG.toml", "cia402", *options) as bench:
        bench.misbehave("torque", "lose", 2)
        _, failed = tried(bench.rig, settings(250.0))
    assert {"torque samples", "torque noise (SD)", "lost or damaged messages"} <= set(failed)
