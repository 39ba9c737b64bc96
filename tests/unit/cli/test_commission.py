"""`rigidimeter commission` and `emulate`: what is refused before anything is tried, or written."""

from __future__ import annotations

import os
import signal
from datetime import UTC, datetime

import pytest

from rigidimeter.cli.commission import _check_known
from rigidimeter.cli.emulate import _check_target
from rigidimeter.cli.rig_checks import interrupted_once
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning import (
    MUST_PASS,
    CommissioningRecord,
    RigCheck,
    covered,
    program_identity,
    record_path,
    repeated_path,
    write_record,
)
from rigidimeter.rig.devices import load_rig

HARDWARE = """
[torque_sensor]
driver = "ati-rdt"
address = "192.168.1.1"
[drive]
driver = "cia402"
interface = "socketcan"
channel = "can0"
"""


def test_a_record_that_cannot_be_written_is_refused_before_the_trials(rigidimeter, tmp_path):
    rig = tmp_path / "RIG.toml"
    rig.write_text(HARDWARE)
    (tmp_path / "folder").mkdir()
    for out, words in (
        (tmp_path / "nowhere" / "record.json", "cannot be written (there is no folder"),
        (tmp_path / "folder", "cannot be written (it is a folder)"),
        (rig, "is read or written already"),
    ):
        signed = ("--signed-by", "A. Weber")
        ran = rigidimeter("commission", "--rig", rig, "--out", out, *signed)
        assert ran.status == 1
        assert words in ran.err
    assert rig.read_text() == HARDWARE


def test_hardware_does_not_move_by_a_consent_that_nobody_gave(rigidimeter, tmp_path):
    rig = tmp_path / "RIG.toml"
    rig.write_text(HARDWARE)
    ran = rigidimeter("commission", "--rig", rig, "--yes", "--signed-by", "A. Weber")
    assert (ran.status, "is real hardware; somebody must check" in ran.err) == (1, True)


def test_where_program_and_computer_are_those_of_the_record_nothing_is_repeated(
    rigidimeter, tmp_path
):
    rig = tmp_path / "RIG.toml"
    rig.write_text(HARDWARE)
    again = ("commission", "--rig", rig, "--again", "--signed-by", "A. Weber")
    ran = rigidimeter(*again)
    assert (ran.status, "nobody can answer the questions" in ran.err) == (1, True)
    emulated = HARDWARE.replace("192.168.1.1", "127.0.0.1").replace("socketcan", "virtual")
    rig.write_text(emulated)
    ran = rigidimeter(*again, "--yes")
    assert (ran.status, "there is no such record" in ran.err) == (1, True)
    rigfile, settings = load_rig(rig), Settings()
    record = CommissioningRecord(
        rig_name=rigfile.name,
        rig_digest=rigfile.digest,
        facts={},
        covered=covered(settings),
        checks=tuple(
            RigCheck(name, 1.0, "s", "", "passed") for name in (*MUST_PASS, "stability with OFF")
        ),
        numbers={},
        software="0.1",
        made_utc=datetime.now(UTC).isoformat(),
        emulated=True,
        identity=program_identity(rigfile),
    )
    write_record(record_path(rig), record)
    ran = rigidimeter(*again, "--yes")
    assert (ran.status, "Nothing to repeat" in ran.out) == (0, True)
    assert not repeated_path(rig).exists()


@pytest.mark.parametrize("value", [0.0, float("nan"), float("inf")])
def test_a_known_torque_that_tells_nothing_is_refused(value):
    with pytest.raises(UserError, match=r"--known-torque-nm \S+: must be a number other than 0"):
        _check_known({"--known-torque-nm": value})


@pytest.mark.parametrize(
    "number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP]
)
def test_who_interrupts_twice_does_not_break_off_the_stopping(tmp_path, number):
    before, steps = signal.getsignal(number), []
    record = tmp_path / "record.json"

    def trials():
        try:
            os.kill(os.getpid(), number)
        finally:
            for step in ("stop", "disable", "close"):
                os.kill(os.getpid(), signal.SIGINT)
                steps.append(step)

    said = r"the rig was stopped, and .*record\.json was not written"
    with pytest.raises(UserError, match=said), interrupted_once(record, "commission again"):
        trials()
    assert steps == ["stop", "disable", "close"]
    assert signal.getsignal(number) == before


def test_an_emulation_writes_over_no_rig_file_of_hardware(tmp_path):
    path = tmp_path / "RIG.toml"
    _check_target(path)
    path.write_text(HARDWARE)
    with pytest.raises(
        UserError, match=r"RIG\.toml: already exists and is not the rig file of an emu"
    ):
        _check_target(path)
    path.write_text(
        HARDWARE.replace("192.168.1.1", "127.0.0.1").replace("socketcan", "udp_multicast")
    )
    _check_target(path)
    with pytest.raises(UserError, match="there is no folder"):
        _check_target(tmp_path / "nowhere" / "RIG.toml")
