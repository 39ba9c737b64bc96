"""What an operator reads: the table, and refusals before anything moves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from rigidimeter.cli.commission import commission as command
from rigidimeter.cli.rig_checks import table
from rigidimeter.cli.terminal_tables import text_lines
from rigidimeter.core.errors import UserError
from rigidimeter.rig.commissioning import above, below, check_record, untried

RIG = """
[torque_sensor]
driver = "ati-rdt"
address = "{address}"

[drive]
driver = "cia402"
interface = "{interface}"
"""


def test_times_below_a_second_are_in_ms() -> None:
    check = below("lateness", 0.00375, "s", 0.001, "be quicker")
    assert check.sentence == "lateness: 3.75 ms, must be at most 1 ms; be quicker"
    assert above("rate", 250.0, "1/s", 225.0, "").words == "250 1/s"


def test_the_table_says_what_was_found_what_must_be_and_what_helps(commissioned: Any) -> None:
    record = commissioned(braking_rad_s2=60.0)
    lines = text_lines([table(record.checks)], 200)
    assert lines[0].split() == ["check", "found", "must", "be"]
    at = next(n for n, line in enumerate(lines) if line.startswith("FAIL"))
    assert lines[at].split("  ")[1:2] == ["braking of the drive"]
    assert "3438 deg/s²" in lines[at]
    assert "at least 6000 deg/s²" in lines[at]
    assert "raise the drive's decelerations in the rig file" in lines[at + 1]
    shown = text_lines([table(commissioned(present=False).checks)])
    assert f"{' ' * 6}{untried('emergency stop', 'seen at once').remedy}" in shown


def test_a_rig_of_hardware_is_not_tried_without_a_name(tmp_path: Path) -> None:
    rig = tmp_path / "RIG.toml"
    rig.write_text(RIG.format(address="192.168.1.1", interface="socketcan"))
    with pytest.raises(UserError, match="is real hardware; name the person responsible for it"):
        command(rig, None, " ", True, None, None, None, None)
    assert not list(tmp_path.glob("*.json"))


@pytest.mark.parametrize(
    ("address", "interface", "emulated"),
    [
        ("127.0.0.1", "udp_multicast", True),
        ("localhost", "virtual", True),
        ("192.168.1.1", "virtual", False),
        ("127.0.0.1", "socketcan", False),
    ],
)
def test_the_wires_say_whether_a_rig_is_emulated(
    tmp_path: Path, address: str, interface: str, emulated: bool
) -> None:
    from rigidimeter.rig.devices import load_rig

    rig = tmp_path / "RIG.toml"
    rig.write_text(RIG.format(address=address, interface=interface))
    rigfile = load_rig(rig)
    assert rigfile.emulated is emulated
    with pytest.raises(UserError, match="there is no such record"):
        check_record(rigfile, None, None)  # type: ignore[arg-type]
