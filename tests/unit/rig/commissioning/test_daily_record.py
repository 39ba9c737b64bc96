"""For what and how long a daily check holds."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, changed_settings, parse_settings
from rigidimeter.model import DriveModel
from rigidimeter.rig.commissioning import (
    DAILY_MUST_PASS,
    DailyRecord,
    ReferenceInertia,
    RigCheck,
    as_measured,
    daily_path,
    read_daily,
    require_daily_check,
    write_daily,
)
from rigidimeter.rig.devices import RigFile

NOW = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)
HERE = {"version": "0.1", "guard_sources": "a", "host": "rig-pc", "kernel": "6.1", "governor": ""}
COMMISSIONED: Any = SimpleNamespace(digest="of the commissioning")


@pytest.fixture
def rigfile(tmp_path: Path) -> RigFile:
    return RigFile(tmp_path / "RIG.toml", "rig", {}, "abc")


@pytest.fixture
def record(rigfile: RigFile) -> DailyRecord:
    made_utc = "2026-03-01T08:00:00+00:00"
    record = DailyRecord(
        rig_name="rig",
        rig_digest="abc",
        commissioning_digest=COMMISSIONED.digest,
        checks=tuple(RigCheck(name, 1.0, "1", "", "passed") for name in DAILY_MUST_PASS),
        numbers={"inertia_kg_m2": 0.002},
        reference=ReferenceInertia(0.002, 2e-5, made_utc, COMMISSIONED.digest, "first", 0.003),
        known_inertia_kg_m2=None,
        validity_h=24.0,
        software="0.1",
        made_utc=made_utc,
        identity=HERE,
        boot_id="a",
        boot_s=100.0,
    )
    write_daily(daily_path(rigfile.path), record)
    return record


def require(rigfile: RigFile, settings: Settings | None = None, **options: Any) -> DailyRecord:
    held: dict[str, Any] = {"now_utc": NOW, "identity": HERE, "boot": ("a", 100.0), **options}
    return require_daily_check(rigfile, COMMISSIONED, settings or Settings(), **held)


def rewritten(rigfile: RigFile, record: DailyRecord, **changes: Any) -> None:
    write_daily(daily_path(rigfile.path), replace(record, **changes))


def test_the_record_comes_back_as_it_was(rigfile: RigFile, record: DailyRecord) -> None:
    path = daily_path(rigfile.path)
    assert path.name == "RIG.checked.json"
    assert read_daily(path) == record
    values = json.loads(path.read_text())
    assert (values["schema"], values["passed"]) == ("rigidimeter.check/1", True)
    assert require(rigfile) == record


def test_a_refusal_says_what_to_type(rigfile: RigFile, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no such record; make it with `rigidimeter check .*toml`"):
        require(rigfile)
    with pytest.raises(UserError, match=r"`rigidimeter check .*RIG.toml --settings .*study.toml`"):
        require(rigfile, settings_path=tmp_path / "study.toml")


def test_an_edited_record_is_refused(rigfile: RigFile, record: DailyRecord) -> None:
    path = daily_path(rigfile.path)
    path.write_text(path.read_text().replace('"validity_h": 24.0', '"validity_h": 99.0'))
    with pytest.raises(UserError, match=r"was changed since it was written .*rigidimeter check"):
        require(rigfile)


@pytest.mark.parametrize(
    ("now", "words"),
    [
        ("2026-03-02T08:00:00", None),
        ("2026-03-02T08:00:01", "holds for 24 h; with nobody in the rig, type `rigidimeter check"),
        ("2026-03-01T07:55:00", None),
        ("2026-03-01T07:49:00", "which is still to come; set the computer's clock right"),
    ],
)
def test_a_check_holds_for_a_day(
    rigfile: RigFile, record: DailyRecord, now: str, words: str | None
) -> None:
    now_utc = datetime.fromisoformat(now).replace(tzinfo=UTC)
    if words is None:
        assert require(rigfile, now_utc=now_utc) == record
    else:
        with pytest.raises(UserError, match=words):
            require(rigfile, now_utc=now_utc)


def test_the_shorter_time_counts(rigfile: RigFile, record: DailyRecord) -> None:
    short = parse_settings({"commissioning": {"daily_validity_h": 3.0}})
    with pytest.raises(UserError, match="holds for 3 h"):
        require(rigfile, short)
    rewritten(rigfile, record, validity_h=2.0)
    long = parse_settings({"commissioning": {"daily_validity_h": 100.0}})
    with pytest.raises(UserError, match="holds for 2 h"):
        require(rigfile, long)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rig_digest": "abd"}, "is for another content of .*RIG.toml"),
        ({"commissioning_digest": "x"}, "was made before the rig was commissioned again"),
        (
            {"checks": (RigCheck("inertia", 1.0, "kg·m²", "2 kg·m²", "failed", "look"),)},
            "a check failed: inertia: 1 kg·m², must be 2 kg·m²; look",
        ),
    ],
)
def test_what_does_not_hold_is_refused(
    rigfile: RigFile, record: DailyRecord, changes: dict[str, Any], words: str
) -> None:
    rewritten(rigfile, record, **changes)
    with pytest.raises(UserError, match=words):
        require(rigfile)


@pytest.mark.parametrize("name", DAILY_MUST_PASS)
def test_nothing_that_matters_may_be_missing(
    rigfile: RigFile, record: DailyRecord, name: str
) -> None:
    fewer = tuple(check for check in record.checks if check.name != name)
    rewritten(rigfile, record, checks=fewer)
    with pytest.raises(UserError, match=f"the check '{name}' is missing"):
        require(rigfile)


def measured(bandwidth_hz: float = 50.0) -> Any:
    return SimpleNamespace(rig_name="rig", numbers={"bandwidth_hz": bandwidth_hz})


@pytest.mark.parametrize(
    ("guard", "inertia_kg_m2", "floor_kg_m2"),
    [
        ({}, 0.002, 0.001),
        ({}, 0.0004, 0.0005),  # the default is not lowered
        ({"min_inertia_kg_m2": 0.0007}, 0.002, 0.0007),
        ({"min_inertia_kg_m2": 0.0}, 0.002, 0.0),
    ],
)
def test_half_the_measured_inertia_is_the_guards_floor(
    record: DailyRecord, guard: dict[str, float], inertia_kg_m2: float, floor_kg_m2: float
) -> None:
    assert record.reference is not None
    today = replace(record, reference=replace(record.reference, inertia_kg_m2=inertia_kg_m2))
    settings = as_measured(parse_settings({"guard": guard}), measured(), today)
    assert settings.guard.min_inertia_kg_m2 == pytest.approx(floor_kg_m2, rel=0.01)
    assert as_measured(settings, measured(), replace(record, reference=None)) == settings


@pytest.mark.parametrize("bandwidth_hz", [20.0, 50.0, 53.0])
def test_the_floor_is_half_of_what_an_even_acceleration_shows_at_the_ticks(
    record: DailyRecord, bandwidth_hz: float
) -> None:
    """The command rises by 1 rad/s each 10 ms, so the acceleration is 100 rad/s² on average."""
    drive = DriveModel.second_order(bandwidth_hz, 0.7071)
    seen_rad_s2 = drive.held(np.arange(100.0), 0.01).acceleration_rad_s2[-1]
    settings = as_measured(at_100_hz(), measured(bandwidth_hz), heavy(record))
    assert settings.rig.drive_bandwidth_hz == bandwidth_hz
    assert settings.guard.min_inertia_kg_m2 == pytest.approx(0.5 * 0.02 * seen_rad_s2 / 100.0)


def test_ticks_that_show_no_inertia_do_not_raise_the_floor(record: DailyRecord) -> None:
    settings = as_measured(at_100_hz(), measured(53.1), heavy(record))
    assert settings.guard.min_inertia_kg_m2 == 0.0005
    assert settings.rig.drive_bandwidth_hz == 53.1  # at least
    told = changed_settings(at_100_hz(), {"rig": {"drive_bandwidth_hz": 200.0}})
    assert as_measured(told, measured(53.1), heavy(record)) == told


def at_100_hz() -> Settings:
    sensor = {"rate_hz": 100.0}
    rig = {"tick_rate_hz": 100.0, "torque": sensor, "motion": sensor}
    return parse_settings({"rig": rig, "guard": {"reaction_time_s": 0.1}})


def heavy(record: DailyRecord) -> DailyRecord:
    assert record.reference is not None
    return replace(record, reference=replace(record.reference, inertia_kg_m2=0.02))


def test_a_reaction_time_too_short_for_the_drive_as_it_was_measured_is_refused(
    record: DailyRecord,
) -> None:
    with pytest.raises(UserError, match=r"rig, as measured: .*reaction_time_s = 0.02"):
        as_measured(Settings(), measured(10.0), record)


def test_a_clock_that_was_set_back_by_a_day_does_not_renew_a_check(
    rigfile: RigFile, record: DailyRecord
) -> None:
    """28 h after it, the clock on the wall says 4: the time since the computer started tells."""
    assert require(rigfile, boot=("a", 100.0 + 23.9 * 3600.0)) == record
    with pytest.raises(UserError, match=r"28 h have passed since, so its clock was set back"):
        require(rigfile, boot=("a", 100.0 + 28.0 * 3600.0))
    # After another start nothing is known but the clock on the wall.
    assert require(rigfile, boot=("b", 100.0 + 28.0 * 3600.0)) == record
    rewritten(rigfile, record, boot_id="")
    assert require(rigfile, boot=("", 100.0 + 28.0 * 3600.0)).passed


def test_a_check_belongs_to_a_program_and_a_computer(rigfile: RigFile, record: DailyRecord) -> None:
    with pytest.raises(UserError, match=r"the kernel was 6\.1 and is now 6\.2; with nobody in the"):
        require(rigfile, identity={**HERE, "kernel": "6.2"})
