from __future__ import annotations

import json
import re
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.rig.commissioning import (
    A_PERSON_TELLS,
    FLOORS,
    LIMITS,
    MUST_PASS,
    CommissioningRecord,
    RigCheck,
    check_record,
    covered,
    digest,
    read_record,
    record_path,
    stable_facts,
    untried,
    write_record,
)
from rigidimeter.rig.devices import RigFile

TODAY = datetime(2026, 3, 1, tzinfo=UTC)
HERE = {"version": "0.1", "guard_sources": "a", "host": "rig-pc", "kernel": "6.1", "governor": ""}
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
    names = (*MUST_PASS, *A_PERSON_TELLS, "stability with OFF")
    record = CommissioningRecord(
        rig_name="rig",
        rig_digest="abc",
        facts=stable_facts(FACTS),
        covered=covered(Settings()),
        checks=tuple(RigCheck(name, 1.0, "s", "", "passed") for name in names),
        numbers={"torque_delay_s": 0.002},
        software="0.1",
        made_utc="2026-01-01T12:00:00+00:00",
        signed_by="A. Weber",
        identity=HERE,
    )
    write_record(record_path(rigfile.path), record)
    return record


def check(rigfile: RigFile, facts: Any = FACTS, settings: Settings | None = None) -> Any:
    return check_record(rigfile, facts, settings or Settings(), now_utc=TODAY, identity=HERE)


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


@pytest.mark.parametrize("outcome", ["failed", "not possible here", "not tried", None])
def test_a_record_without_the_trial_of_the_watchdog_is_refused(
    rigfile: RigFile, record: CommissioningRecord, outcome: str | None
) -> None:
    """That the drive reads its watchdog back as written does not make up for it."""
    tried = {check.name: check for check in record.checks}
    assert tried["watchdog configured"].passed
    tried["watchdog"] = replace(tried["watchdog"], outcome=outcome or "")
    kept = tuple(check for check in tried.values() if check.outcome)
    write_record(record_path(rigfile.path), replace(record, checks=kept))
    with pytest.raises(UserError, match="watchdog"):
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
        (
            changed("torque_sensor", "values", {"counts_per_torque": 1e6, "range_nm": 50.0}),
            "torque_sensor now has range_nm = 50.0, which the record does not name; commission the",
        ),
        (
            changed("torque_sensor", "values", {}),
            "torque_sensor had counts_per_torque = 1000000.0 and no longer names it; set it back",
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
        with pytest.raises(UserError, match=r"holds for 1 day[ ;]"):
            check(rigfile, settings=parse_settings({"commissioning": {"validity_days": 1.0}}))


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


def test_a_record_of_tomorrow_says_to_set_the_clock(
    rigfile: RigFile, record: CommissioningRecord
) -> None:
    write_record(record_path(rigfile.path), replace(record, made_utc="2126-03-09T12:00:00+00:00"))
    with pytest.raises(UserError, match=r"which is still to come.*set the computer's clock right"):
        check(rigfile)


@pytest.mark.parametrize(
    "changes",
    [{"made_utc": "yesterday"}, {"made_utc": None}, {"later": 1}, {"checks": [{"name": "x"}]}],
)
def test_a_record_of_another_version_is_refused_with_a_sentence(
    rigfile: RigFile, record: CommissioningRecord, changes: dict[str, Any]
) -> None:
    sealed(rigfile, changes)
    with pytest.raises(UserError, match=r"written by another version of .*; commission again"):
        check(rigfile)


def test_a_record_without_a_time_zone_is_refused(
    rigfile: RigFile, record: CommissioningRecord
) -> None:
    sealed(rigfile, {"made_utc": "2026-03-01T12:00:00"})
    with pytest.raises(UserError, match="names no time zone; commission again"):
        check(rigfile)


def test_a_record_that_covers_nothing_is_refused(
    rigfile: RigFile, record: CommissioningRecord
) -> None:
    sealed(rigfile, {"covered": {}})
    with pytest.raises(UserError, match=r"covers rig\.tick_rate_hz = None Hz, not"):
        check(rigfile)


def sealed(rigfile: RigFile, changes: dict[str, Any]) -> None:
    """Write the record with other content and a seal that fits."""
    path = record_path(rigfile.path)
    values = json.loads(path.read_text(encoding="utf-8")) | changes
    values.pop("digest")
    path.write_text(json.dumps(values | {"digest": digest(values)}), encoding="utf-8")


def test_a_failed_check_is_refused(rigfile: RigFile, record: CommissioningRecord) -> None:
    bad = RigCheck("known torque", 1.1, "N·m", "1 N·m ± 5 %", "failed", "calibrate")
    write_record(record_path(rigfile.path), replace(record, checks=(*record.checks, bad)))
    with pytest.raises(UserError, match=r"known torque: 1.1 N·m, must be 1 N·m ± 5 %; calibrate"):
        check(rigfile)


@pytest.mark.parametrize("name", [*MUST_PASS, *A_PERSON_TELLS, "stability with OFF"])
def test_nothing_that_matters_may_be_missing(
    rigfile: RigFile, record: CommissioningRecord, name: str
) -> None:
    fewer = tuple(check for check in record.checks if check.name != name)
    write_record(record_path(rigfile.path), replace(record, checks=fewer))
    said = "stability" if name.startswith("stability") else name
    with pytest.raises(UserError, match=f"the check '{re.escape(said)}' is missing"):
        check(rigfile)


@pytest.mark.parametrize("name", A_PERSON_TELLS)
def test_what_a_flag_answered_for_is_good_for_an_emulated_rig_only(
    rigfile: RigFile, record: CommissioningRecord, name: str
) -> None:
    checks = [c if c.name != name else untried(name, "yes") for c in record.checks]
    loose = replace(record, checks=tuple(checks), signed_by="")
    write_record(record_path(rigfile.path), loose)
    with pytest.raises(UserError, match=f"'{name}' is missing: only a person can tell"):
        check(rigfile)
    emulated = replace(rigfile, devices={"drive": (object, SimpleNamespace(emulated=True))})
    write_record(record_path(rigfile.path), replace(loose, emulated=True))
    assert check(emulated).not_tried == (name,)
    with pytest.raises(UserError, match="was made without hardware, and this rig has some"):
        check(rigfile)


def test_hardware_wants_a_name(rigfile: RigFile, record: CommissioningRecord) -> None:
    write_record(record_path(rigfile.path), replace(record, signed_by=" "))
    with pytest.raises(UserError, match=r"nobody has signed for it: .* --signed-by NAME"):
        check(rigfile)


def test_the_record_is_looked_at_before_the_devices(
    rigfile: RigFile, record: CommissioningRecord
) -> None:
    assert check(rigfile, None).passed
    write_record(record_path(rigfile.path), replace(record, signed_by=""))
    with pytest.raises(UserError, match="nobody has signed"):
        check(rigfile, None)


def test_one_device_of_hardware_makes_a_rig_of_hardware(rigfile: RigFile) -> None:
    emulated, true = SimpleNamespace(emulated=True), SimpleNamespace()
    assert replace(rigfile, devices={"drive": (object, emulated)}).emulated
    mixed = {"torque_sensor": (object, true), "drive": (object, emulated)}
    assert not replace(rigfile, devices=mixed).emulated
    assert not replace(rigfile, devices={}).emulated


COVERED = [
    (table, key)
    for table, fields in covered(Settings()).items()
    if table in LIMITS
    for key in fields
]
"""Every number of the tables in which a protocol may ask for less."""


def test_every_field_of_guard_loop_and_zeroing_is_covered() -> None:
    walked = {table: {key for of, key in COVERED if of == table} for table in LIMITS}
    settings = Settings()
    for table in ("guard", "loop", "zeroing"):
        assert walked[table] == set(type(getattr(settings, table)).model_fields)
    assert walked["prbs"] == {"amplitude_nm"}
    assert walked["sinusoid"] == {"amplitude_deg", "frequency_hz"}


def with_value(table: str, key: str, factor: float) -> Settings:
    """Return the default settings with one number changed, whatever the checks would say."""
    settings = Settings()
    section = getattr(settings, table)
    value = getattr(section, key)
    changed = value + (1 if factor > 1 else -1) if isinstance(value, int) else factor * value
    return settings.model_copy(update={table: section.model_copy(update={key: changed})})


THE_SAME = ("guard.reaction_time_s", "guard.stale_s", "zeroing.duration_s")
"""A shorter time is not safer: the guard would count on a quicker drive, the zero be noisier."""


@pytest.mark.parametrize(("table", "key"), COVERED)
def test_tighter_is_covered_and_looser_is_not(
    rigfile: RigFile, record: CommissioningRecord, table: str, key: str
) -> None:
    less, more = with_value(table, key, 0.99), with_value(table, key, 1.01)
    tighter, looser = (more, less) if key in FLOORS else (less, more)
    with pytest.raises(UserError, match=rf"covers {table}\.{key} = .*, not "):
        check(rigfile, settings=looser)
    if f"{table}.{key}" in THE_SAME:
        with pytest.raises(UserError, match=rf"covers {table}\.{key} = "):
            check(rigfile, settings=tighter)
    else:
        assert check(rigfile, settings=tighter).passed


@pytest.mark.parametrize("key", type(Settings().controller).model_fields)
@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_another_controller_is_never_covered(
    rigfile: RigFile, record: CommissioningRecord, key: str, factor: float
) -> None:
    with pytest.raises(UserError, match=rf"covers controller\.{key} = "):
        check(rigfile, settings=with_value("controller", key, factor))
