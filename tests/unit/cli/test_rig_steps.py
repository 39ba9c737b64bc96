"""The steps before a session: what the page says of a rig is what `run` says as it refuses."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rigidimeter.cli.planned_session import checked_rig, new_session
from rigidimeter.cli.rig_steps import CHECKED, COMMISSIONED, rig_steps
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning import (
    A_PERSON_TELLS,
    DAILY_MUST_PASS,
    MUST_PASS,
    CommissioningRecord,
    DailyRecord,
    RigCheck,
    covered,
    daily_path,
    program_identity,
    record_path,
    write_daily,
    write_record,
)
from rigidimeter.rig.console.page import start_refusal
from rigidimeter.rig.devices import MotionRange, RigFile

NOW = datetime.now(UTC).replace(microsecond=0)
SETTINGS = Settings()


def passed(*names: str) -> tuple[RigCheck, ...]:
    return tuple(RigCheck(name, 1.0, "1", "", "passed") for name in names)


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A rig of hardware that is commissioned with a person and checked."""
    path = tmp_path / "RIG.toml"
    for module in ("rig_steps", "planned_session"):
        monkeypatch.setattr(
            f"rigidimeter.cli.{module}.load_rig",
            lambda path: RigFile(path, "rig", {}, "abc", absolute_angle=True),
        )
    monkeypatch.setattr(RigFile, "claim", lambda _: SimpleNamespace(close=lambda: None))
    commissioned = CommissioningRecord(
        rig_name="rig",
        rig_digest="abc",
        facts={},
        covered=covered(SETTINGS),
        checks=passed(*MUST_PASS, *A_PERSON_TELLS, "stability with OFF"),
        numbers={
            **{"gain_margin_db_OFF": 14.7, "gain_margin_db_DBS": 13.2},
            **{"mechanical_stop_low_deg": -60.0, "mechanical_stop_high_deg": 60.0},
        },
        software="0.1",
        made_utc=(NOW - timedelta(days=2)).isoformat(),
        signed_by="A. Weber",
        identity=program_identity(RigFile(path, "rig", {}, "abc")),
    )
    write_record(record_path(path), commissioned)
    checked = DailyRecord(
        rig_name="rig",
        rig_digest="abc",
        commissioning_digest=commissioned.digest,
        checks=passed(*DAILY_MUST_PASS),
        numbers={"inertia_kg_m2": 0.002},
        reference=None,
        known_inertia_kg_m2=None,
        validity_h=24.0,
        software="0.1",
        made_utc=(NOW - timedelta(hours=1)).isoformat(),
        identity=commissioned.identity,
    )
    write_daily(daily_path(path), checked)
    return path


def commission_again(rig: Path, **changes: Any) -> None:
    from rigidimeter.rig.commissioning import read_record

    path = record_path(rig)
    write_record(path, replace(read_record(path), **changes))


def check_again(rig: Path, **changes: Any) -> None:
    from rigidimeter.rig.commissioning import read_daily

    path = daily_path(rig)
    write_daily(path, replace(read_daily(path), **changes))


def refusal_of_run(rig: Path) -> str:
    try:
        planned = new_session(SETTINGS, {}, None)
        checked_rig(planned.within(MotionRange(-50.0, 50.0)), rig)
    except UserError as error:
        return str(error)
    return ""


def test_a_rig_that_is_ready_says_since_when_with_whom_and_which_margin(rig: Path) -> None:
    steps = {step.title: step for step in rig_steps(rig, SETTINGS)}
    assert start_refusal(tuple(steps.values())) == refusal_of_run(rig) == ""
    found = steps[COMMISSIONED].found
    assert f"{(NOW - timedelta(days=2)).astimezone():%Y-%m-%d %H:%M}" in found
    assert "with a person, signed by A. Weber" in found
    assert "smallest gain margin 13.2 dB" in found
    assert f"holds until {(NOW + timedelta(hours=23)).astimezone():%Y-%m-%d %H:%M}" in (
        steps[CHECKED].found
    )


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda rig: record_path(rig).unlink(), "there is no such record; make it with"),
        (lambda rig: commission_again(rig, rig_digest="of another"), "is for another content of"),
        (lambda rig: commission_again(rig, signed_by=" "), "nobody has signed for it"),
        (lambda rig: commission_again(rig, checks=passed(*MUST_PASS)), "only a person|is missing"),
        (lambda rig: daily_path(rig).unlink(), "with nobody in the rig|there is no such record"),
        (
            lambda rig: check_again(rig, made_utc=(NOW - timedelta(hours=25)).isoformat()),
            "a daily check holds for 24 h",
        ),
    ],
)
def test_the_page_refuses_in_the_words_of_run(rig: Path, spoil: Any, words: str) -> None:
    spoil(rig)
    why = start_refusal(rig_steps(rig, SETTINGS))
    assert any(part in why for part in words.split("|"))
    assert why == refusal_of_run(rig)


def test_a_record_without_a_person_says_so(rig: Path) -> None:
    commission_again(rig, checks=passed(*MUST_PASS, "stability with OFF"))
    first, second, zero = rig_steps(rig, SETTINGS)
    assert (first.state, "without a person" in first.found) == ("not done", True)
    assert (second.state, second.action) == ("not done", "")
    assert (zero.state, zero.required) == ("optional", False)


def test_nobody_asks_for_the_steps_of_the_virtual_rig() -> None:
    assert start_refusal(rig_steps(None, SETTINGS)) == ""
