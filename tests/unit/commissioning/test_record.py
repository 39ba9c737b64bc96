from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from rigidimeter.commissioning import (
    Check,
    CommissioningRecord,
    check_record,
    read_record,
    record_path,
    write_record,
)
from rigidimeter.commissioning.record import MUST_PASS, covered, kept_facts
from rigidimeter.device.rigfile import RigFile
from rigidimeter.errors import UserError
from rigidimeter.settings import Settings, parse_settings

TODAY = datetime(2026, 3, 1, tzinfo=UTC)
FACTS: dict[str, Any] = {
    "torque_sensor": {
        "model": "Net F/T",
        "serial": "T1",
        "fastest_tick_rate_hz": 7000.0,
        "watchdog_s": None,
        "values": {"counts_per_torque": 1e6, "bias": "1;2;3", "status": 0},
    },
    "drive": {
        "model": "servo",
        "serial": "D1",
        "fastest_tick_rate_hz": 900.0,
        "watchdog_s": 0.1,
        "values": {"mode": 3, "cycle_s": 0.0101},
    },
}


@pytest.fixture
def rigfile(tmp_path: Path) -> RigFile:
    return RigFile(tmp_path / "RIG.toml", "rig", {}, "abc")


@pytest.fixture
def record(rigfile: RigFile) -> CommissioningRecord:
    names = (*MUST_PASS, "stability with OFF")
    record = CommissioningRecord(
        rig_name="rig",
        rig_digest="abc",
        facts=kept_facts(FACTS),
        covered=covered(Settings()),
        checks=tuple(Check(name, 1.0, "s", "", "passed") for name in names),
        numbers={"torque_delay_s": 0.002},
        software="0.1",
        made_utc="2026-01-01T12:00:00+00:00",
        signed_by="A. Weber",
    )
    write_record(record_path(rigfile.path), record)
    return record


def check(rigfile: RigFile, facts: Any = FACTS, settings: Settings | None = None) -> Any:
    return check_record(rigfile, facts, settings or Settings(), now_utc=TODAY)


def changed(role: str, key: str, value: Any) -> Any:
    return {**FACTS, role: {**FACTS[role], key: value}}


def test_the_record_comes_back_as_it_was(rigfile: RigFile, record: CommissioningRecord) -> None:
    path = record_path(rigfile.path)
    assert path.name == "RIG.commissioned.json"
    found = read_record(path)
    assert found.checks == record.checks
    assert found.numbers == record.numbers
    assert found.signed_by == "A. Weber"
    assert json.loads(path.read_text())["schema"] == "rigidimeter.commissioning/1"
    assert check(rigfile).passed


def test_what_means_nothing_may_change(rigfile: RigFile, record: CommissioningRecord) -> None:
    values = {"counts_per_torque": 1e6, "bias": "9;9;9", "status": 1 << 16}
    facts = changed("torque_sensor", "values", values)
    facts["drive"] = {**facts["drive"], "fastest_tick_rate_hz": 800.0}
    assert check(rigfile, facts).passed


def test_there_must_be_a_record(rigfile: RigFile) -> None:
    with pytest.raises(UserError, match="there is no such record; make it with"):
        check(rigfile)


def test_an_edited_record_is_refused(rigfile: RigFile, record: CommissioningRecord) -> None:
    path = record_path(rigfile.path)
    path.write_text(path.read_text().replace('"torque_delay_s": 0.002', '"torque_delay_s": 0.001'))
    with pytest.raises(UserError, match="was changed since it was written"):
        check(rigfile)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema": "other"}'])
def test_something_else_is_refused(rigfile: RigFile, text: str) -> None:
    record_path(rigfile.path).write_text(text)
    with pytest.raises(UserError, match="record"):
        check(rigfile)


def test_another_rig_file_is_refused(rigfile: RigFile, record: CommissioningRecord) -> None:
    with pytest.raises(UserError, match="is for another content of"):
        check(replace(rigfile, digest="abd"))


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        (changed("torque_sensor", "serial", "T2"), "serial 'T1' and now has 'T2'"),
        (changed("drive", "watchdog_s", None), "watchdog_s 0.1 and now has None"),
        (
            changed("torque_sensor", "values", {"counts_per_torque": 2e6}),
            "counts_per_torque = 1000000.0 and now has 2000000.0",
        ),
        ({**FACTS, "enable_line": FACTS["drive"]}, "enable_line"),
    ],
)
def test_other_devices_are_refused(
    rigfile: RigFile, record: CommissioningRecord, facts: Any, words: str
) -> None:
    with pytest.raises(UserError, match=words):
        check(rigfile, facts)


@pytest.mark.parametrize(
    ("made_utc", "good"),
    [
        ("2025-09-02T12:00:00+00:00", True),
        ("2025-09-01T12:00:00+00:00", False),
        ("2026-03-09T12:00:00+00:00", False),
    ],
)
def test_a_record_grows_old(
    rigfile: RigFile, record: CommissioningRecord, made_utc: str, good: bool
) -> None:
    write_record(record_path(rigfile.path), replace(record, made_utc=made_utc))
    if good:
        check(rigfile)
    else:
        with pytest.raises(UserError, match="holds for 180 days"):
            check(rigfile)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"controller": {"inertia_kg_m2": 0.04}}, "controller.inertia_kg_m2"),
        ({"controller": {"torque_cutoff_hz": 30.0}}, "controller.torque_cutoff_hz"),
        ({"guard": {"reaction_time_s": 0.05}}, "guard.reaction_time_s"),
        ({"rig": {"tick_rate_hz": 1200.0}}, "rig.tick_rate_hz"),
        ({"subject": {"OFF": {"inertia_kg_m2": 0.01}, "DBS": {}}}, r"\[subject.OFF\]"),
    ],
)
def test_a_controller_that_was_not_covered_is_refused(
    rigfile: RigFile, record: CommissioningRecord, values: Any, words: str
) -> None:
    with pytest.raises(UserError, match=words):
        check(rigfile, settings=parse_settings(values))


def test_what_does_not_touch_the_loop_may_change(
    rigfile: RigFile, record: CommissioningRecord
) -> None:
    settings = parse_settings({"seed": 7, "prbs": {"amplitude_nm": 0.5}})
    assert check(rigfile, settings=settings).passed


def test_a_failed_check_is_refused(rigfile: RigFile, record: CommissioningRecord) -> None:
    bad = Check("known torque", 1.1, "N·m", "1 N·m ± 5 %", "failed", "calibrate")
    write_record(record_path(rigfile.path), replace(record, checks=(*record.checks, bad)))
    with pytest.raises(UserError, match=r"known torque: 1.1 N·m, must be 1 N·m ± 5 %; calibrate"):
        check(rigfile)


@pytest.mark.parametrize("name", [*MUST_PASS, "stability with OFF"])
def test_nothing_that_matters_may_be_missing(
    rigfile: RigFile, record: CommissioningRecord, name: str
) -> None:
    fewer = tuple(check for check in record.checks if check.name != name)
    write_record(record_path(rigfile.path), replace(record, checks=fewer))
    with pytest.raises(UserError, match="was not possible"):
        check(rigfile)
