"""The table of a drive's objects is that of the code, and the code asks a drive for no others."""

from __future__ import annotations

import itertools
import struct
import time

import can
import pytest
from tests.docs.markdown import ROOT

from rigidimeter.core.settings import parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.rig.devices import Cia402Drive, Cia402Settings, drive_bounds, drive_objects
from rigidimeter.testing import Cia402Emulator, EmulatedArm

PAGE = ROOT / "docs" / "reference" / "drive-objects.md"
BOUNDS = drive_bounds(parse_settings({}))
_channels = itertools.count()


def table() -> list[str]:
    """Return the lines of the table, as the code has it."""
    lines = ["| object | sub-index | name | | what it is for, or what is lost without it |"]
    lines.append("| --- | --- | --- | --- | --- |")
    for row in drive_objects(Cia402Settings(), BOUNDS):
        subs = ", ".join(map(str, row.subindices))
        need = "optional" if row.optional else "**must**"
        lines.append(f"| 0x{row.address:04X} | {subs} | {row.name} | {need} | {row.purpose} |")
    return lines


def test_the_table_is_that_of_the_code() -> None:
    text = PAGE.read_text(encoding="utf-8")
    _, _, rest = text.partition("<!-- objects: begin -->\n\n")
    written, _, _ = rest.partition("\n\n<!-- objects: end -->")
    assert written.splitlines() == table(), "\n".join(table())


def test_each_row_says_why() -> None:
    rows = drive_objects(Cia402Settings(button_bit=0), BOUNDS)
    assert all(row.purpose for row in rows)
    assert any(row.address == 0x60FD and not row.optional for row in rows)


@pytest.mark.parametrize("changes", [{}, {"button_bit": 0}])
def test_a_drive_is_asked_for_these_objects_and_no_others(changes) -> None:
    pytest.importorskip("canopen")
    where = {"interface": "virtual", "channel": f"objects {next(_channels)}"}
    settings = Cia402Settings(**where, **changes, reflected_inertia_kg_m2=0.05, sdo_timeout_s=3.0)
    listening = can.Bus(**where)
    emulator = Cia402Emulator(EmulatedArm(JointDynamics(0.08, 0.5, 10.0)), **where)
    drive = Cia402Drive(settings, time.monotonic)
    drive.bound(BOUNDS)
    try:
        drive.connect()
        drive.configure()
        drive.enable()
        drive.stop()
    finally:
        drive.close()
        emulator.close()
    asked = set()
    for message in iter(lambda: listening.recv(0), None):
        head = message.data[0] if message.data else 0
        if message.arbitration_id == 0x601 and head & 0xE0 in (0x20, 0x40):
            asked.add(struct.unpack_from("<HB", message.data, 1))
    listening.shutdown()
    in_table = {(r.address, sub) for r in drive_objects(settings, BOUNDS) for sub in r.subindices}
    # Read in a frame only, asked for where an answer is lost, or second choice.
    only_in_frames = {(0x1000, 0), (0x606C, 0), (0x6041, 0), (0x6073, 0)}
    assert asked <= in_table
    assert in_table - asked <= only_in_frames
