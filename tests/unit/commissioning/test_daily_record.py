"""For what and how long a daily check holds."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rigidimeter.commissioning import (
    Check,
    DailyRecord,
    daily_path,
    read_daily,
    require_daily_check,
    with_measured_floor,
    write_daily,
)
from rigidimeter.commissioning.daily_record import MUST_PASS, Reference
from rigidimeter.devices.rigfile import RigFile
from rigidimeter.errors import UserError
from rigidimeter.settings import Settings, parse_settings

NOW = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)
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
        checks=tuple(Check(name, 1.0, "1", "", "passed") for name in MUST_PASS),
        numbers={"inertia_kg_m2": 0.002},
        reference=Reference(0.002, 2e-5, made_utc, COMMISSIONED.digest, "first", 0.003),
        known_inertia_kg_m2=None,
        validity_h=24.0,
        software="0.1",
        made_utc=made_utc,
    )
    write_daily(daily_path(rigfile.path), record)
    return record


def require(rigfile: RigFile, settings: Settings | None = None, **options: Any) -> DailyRecord:
    return require_daily_check(
        rigfile, COMMISSIONED, settings or Settings(), **{"now_utc": NOW, **options}
    )


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
            {"checks": (Check("inertia", 1.0, "kg·m²", "2 kg·m²", "failed", "look"),)},
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


@pytest.mark.parametrize("name", MUST_PASS)
def test_nothing_that_matters_may_be_missing(
    rigfile: RigFile, record: DailyRecord, name: str
) -> None:
    fewer = tuple(check for check in record.checks if check.name != name)
    rewritten(rigfile, record, checks=fewer)
    with pytest.raises(UserError, match=f"the check '{name}' is missing"):
        require(rigfile)


@pytest.mark.parametrize(
    ("guard", "inertia_kg_m2", "floor_kg_m2"),
    [
        ({}, 0.002, 0.001),
        ({}, 0.0004, 0.0005),  # the default is not lowered
        ({"least_inertia_kg_m2": 0.0007}, 0.002, 0.0007),
        ({"least_inertia_kg_m2": 0.0}, 0.002, 0.0),
    ],
)
def test_half_the_measured_inertia_is_the_guards_floor(
    record: DailyRecord, guard: dict[str, float], inertia_kg_m2: float, floor_kg_m2: float
) -> None:
    assert record.reference is not None
    today = replace(record, reference=replace(record.reference, inertia_kg_m2=inertia_kg_m2))
    settings = with_measured_floor(parse_settings({"guard": guard}), today)
    assert settings.guard.least_inertia_kg_m2 == pytest.approx(floor_kg_m2)
    assert with_measured_floor(settings, replace(record, reference=None)) == settings
