"""A record of commissioning belongs to a program, a computer and a kernel."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.unit.rig.commissioning.conftest import QUICK, Commissioned, FakeRig, at_hand

import rigidimeter
from rigidimeter.core.errors import UserError
from rigidimeter.rig.commissioning import (
    EVERY_PART,
    IDENTITY,
    CommissioningRecord,
    Operator,
    RepeatedChecks,
    Setup,
    boot_clock,
    check_record,
    differences,
    parts_to_repeat,
    program_identity,
    read_record,
    read_repeated,
    record_path,
    repeat_checks,
    repeated_path,
    sources_digest,
    write_record,
    write_repeated,
)
from rigidimeter.rig.devices import RigFile

JOINT = (0.0045, 0.1368, 1.751)
BY_COMPUTER = ("host", "kernel", "governor")
BY_PROGRAM = ("version", "guard_sources", "loop_sources", "device_sources")


@pytest.fixture
def held(
    tmp_path: Path, commissioned: Commissioned, settings: Any
) -> Callable[..., CommissioningRecord]:
    """Commission a fake rig; give the check of its record under another identity."""
    rigfile = RigFile(tmp_path / "RIG.toml", "fake rig", {}, "digest of the rig file")
    record = commissioned()
    write_record(record_path(rigfile.path), record)
    chosen = settings.model_copy(update={"commissioning": QUICK})

    def check(**other: str) -> CommissioningRecord:
        return check_record(
            rigfile,
            None,
            chosen,
            now_utc=None if "now" in other else _soon(record),
            identity={**record.identity, **other},
        )

    check.rigfile, check.record, check.settings = rigfile, record, chosen  # type: ignore[attr-defined]
    return check


def _soon(record: CommissioningRecord) -> Any:
    from datetime import datetime

    return datetime.fromisoformat(record.made_utc)


def repeated(
    held: Any, fake_rig: Callable[..., FakeRig], *, present: bool = True, **other: str
) -> tuple[RepeatedChecks, list[str]]:
    """Repeat the checks as if the record had been made under another identity."""
    rig, file, timebase, world = fake_rig(JOINT, 0.005, False, {})
    before = replace(held.record, identity={**held.record.identity, **other})
    said: list[str] = []

    def ask(question: str) -> bool:
        said.append(question)
        return at_hand(question, world)

    setup = Setup(rig, held.settings, timebase, Operator(ask=ask, present=present))
    found = repeat_checks(
        setup,
        replace(file, path=held.rigfile.path),
        before,
        lambda _: None,
        made_utc="2026-01-02T00:00:00+00:00",
        signed_by="A. Weber",
    )
    return found, said


def test_nothing_is_asked_for_where_nothing_is_another(held: Any) -> None:
    assert held() == read_record(record_path(held.rigfile.path))
    assert held.record.identity == program_identity(held.rigfile)
    assert set(held.record.identity) == set(IDENTITY)


@pytest.mark.parametrize(
    ("key", "value", "words", "asked"),
    [
        ("guard_sources", "b", "the sources of the guard have changed", EVERY_PART),
        ("loop_sources", "b", "the sources of the loop have changed", EVERY_PART),
        ("device_sources", "b", "the sources of the device drivers have changed", EVERY_PART),
        ("version", "9.9", "the version of rigidimeter was .* and is now 9.9", EVERY_PART),
        ("host", "other-pc", "the computer was .* and is now other-pc", ("watchdog",)),
        ("kernel", "Linux 9", "the kernel was Linux .* and is now Linux 9", ("watchdog",)),
        ("governor", "powersave", "the processor governor was .* is now powersave", ("watchdog",)),
    ],
)
def test_a_difference_is_named_with_the_checks_that_it_asks_for(
    held: Any, key: str, value: str, words: str, asked: tuple[str, ...]
) -> None:
    with pytest.raises(UserError, match=words) as refused:
        held(**{key: value})
    text = str(refused.value)
    assert f"repeat the checks at rest, a small move, {', '.join(asked)}: type" in text
    assert f"rigidimeter commission --rig {held.rigfile.path} --again" in text


@pytest.mark.parametrize("key", [*BY_COMPUTER, *BY_PROGRAM])
def test_what_was_repeated_is_sealed_beside_the_record_and_holds(
    held: Any, fake_rig: Callable[..., FakeRig], key: str
) -> None:
    """The record was made under another `key`; now it is this program's and computer's."""
    found, said = repeated(held, fake_rig, **{key: "before"})
    assert found.objection == ""
    names = {check.name for check in found.checks}
    assert {"lateness of the loop (p99.9)", "torque samples", "motion samples"} <= names
    assert ("delay from command to torque" in names) == (key in BY_PROGRAM)
    assert ("emergency stop" in names) == (key in BY_PROGRAM)
    assert "watchdog" in names
    assert any(question.startswith("Emergency stop") for question in said) == (key in BY_PROGRAM)

    record = replace(held.record, identity={**held.record.identity, key: "before"})
    write_record(record_path(held.rigfile.path), record)
    now = held.record.identity
    with pytest.raises(UserError, match="type `rigidimeter commission"):
        held(**now)
    written = replace(found, commissioning_digest=record.digest)
    write_repeated(repeated_path(held.rigfile.path), written)
    assert read_repeated(repeated_path(held.rigfile.path)) == written
    assert held(**now) == record
    # It holds for this identity alone, and for this commissioning.
    with pytest.raises(UserError, match=r"the kernel was .* and is now Linux 10"):
        held(**{**now, "kernel": "Linux 10"})
    write_repeated(repeated_path(held.rigfile.path), replace(written, commissioning_digest="old"))
    with pytest.raises(UserError, match="is of another commissioning"):
        held(**now)


def test_an_edited_repetition_is_refused(held: Any, fake_rig: Callable[..., FakeRig]) -> None:
    found, _ = repeated(held, fake_rig, kernel="before")
    record = replace(held.record, identity={**held.record.identity, "kernel": "before"})
    write_record(record_path(held.rigfile.path), record)
    path = repeated_path(held.rigfile.path)
    write_repeated(path, replace(found, commissioning_digest=record.digest))
    path.write_text(path.read_text().replace('"A. Weber"', '"B. Weber"'))
    with pytest.raises(UserError, match="was changed since it was written"):
        held(**held.record.identity)


def test_a_person_is_there_and_signs(held: Any, fake_rig: Callable[..., FakeRig]) -> None:
    found, _ = repeated(held, fake_rig, present=False, guard_sources="before")
    assert "'the joint moved as described' is missing: only a person can tell" in found.objection
    signed, _ = repeated(held, fake_rig, guard_sources="before")
    assert "nobody has signed" in replace(signed, signed_by=" ").objection
    failed = replace(signed.checks[0], outcome="failed")
    assert "a check failed" in replace(signed, checks=(failed, *signed.checks[1:])).objection


def test_sources_are_those_of_the_modules_whatever_ends_their_lines() -> None:
    """SHA-256 of ``a.py:4:x=1\\n`` by hand."""
    import hashlib

    by_hand = hashlib.sha256(b"a.py:4:x=1\n").hexdigest()
    assert sources_digest({"a.py": b"x=1\n"}) == sources_digest({"a.py": b"x=1\r\n"}) == by_hand
    assert sources_digest({"a.py": b"x=2\n"}) != by_hand
    assert sources_digest({"b.py": b"x=1\n"}) != by_hand


def test_an_installed_copy_has_the_same_digests_and_compiled_files_do_not_count(
    tmp_path: Path, held: Any
) -> None:
    """As a wheel installs it: another place, Windows ends of lines, other compiled files."""
    source = Path(rigidimeter.__file__).parent
    copy = tmp_path / "site" / "rigidimeter"
    shutil.copytree(source, copy, ignore=shutil.ignore_patterns("__pycache__"))
    step = copy / "rig" / "guard" / "step.py"
    text = step.read_bytes()
    step.write_bytes(text.replace(b"\n", b"\r\n"))
    script = (
        "import json; from types import SimpleNamespace as N; "
        "from rigidimeter.rig.commissioning import program_identity; "
        "print(json.dumps(program_identity(N(devices={}))))"
    )

    def identity() -> Any:
        import json

        ran = subprocess.run(
            [sys.executable, "-c", script],
            env={"PYTHONPATH": str(tmp_path / "site"), "PATH": ""},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        return json.loads(ran.stdout)

    here = program_identity(held.rigfile)
    assert identity() == here  # the first run left compiled files, which the next one sees
    step.write_bytes(text.replace(b"LONGEST_BRAKING = 5", b"LONGEST_BRAKING = 6"))
    changed = identity()
    assert [key for key in IDENTITY if changed[key] != here[key]] == ["guard_sources"]


def test_a_driver_of_others_counts_among_the_devices(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, held: Any
) -> None:
    (tmp_path / "their_driver.py").write_text("class Drive:\n    gain = 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    import importlib

    theirs = importlib.import_module("their_driver").Drive
    file = replace(held.rigfile, devices={"drive": (theirs, SimpleNamespace())})
    one = program_identity(file)
    (tmp_path / "their_driver.py").write_text("class Drive:\n    gain = 2\n")
    other = program_identity(file)
    assert [key for key in IDENTITY if one[key] != other[key]] == ["device_sources"]
    assert one["device_sources"] != program_identity(held.rigfile)["device_sources"]


def test_differences_are_said_in_words() -> None:
    before = dict.fromkeys(IDENTITY, "a")
    assert differences(before, before) == ()
    assert differences(before, {**before, "governor": ""}) == (
        "the processor governor was a and is now unknown",
    )
    assert parts_to_repeat(before, before) == ()


def test_the_time_since_the_start_goes_on() -> None:
    first, second = boot_clock(), boot_clock()
    assert first[0] == second[0]
    assert first[1] <= second[1]
