from __future__ import annotations

import itertools
import math

import pytest
from pydantic import ValidationError

from rigidimeter.rig.devices import (
    NEXT_CONTROL,
    Cia402Drive,
    Cia402Settings,
    Cia402State,
    Control,
    command_bytes,
    emergency,
    fastest_tick_rate_hz,
    frame_bits,
    frames,
    inputs_of,
    objects,
    position_of,
    scale,
    sdo_answer,
    sdo_read_bytes,
    sdo_write_bytes,
    state_of,
    velocity_of,
    velocity_torque_of,
)
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause

# CiA 402-2, the statusword's state coding: x where a bit may be either.
CODES = {
    "xxxx xxxx x0xx 0000": Cia402State.NOT_READY,
    "xxxx xxxx x1xx 0000": Cia402State.SWITCH_ON_DISABLED,
    "xxxx xxxx x01x 0001": Cia402State.READY,
    "xxxx xxxx x01x 0011": Cia402State.SWITCHED_ON,
    "xxxx xxxx x01x 0111": Cia402State.OPERATION_ENABLED,
    "xxxx xxxx x00x 0111": Cia402State.QUICK_STOP_ACTIVE,
    "xxxx xxxx x0xx 1111": Cia402State.FAULT_REACTION,
    "xxxx xxxx x0xx 1000": Cia402State.FAULT,
}


def _mask_and_value(code: str) -> tuple[int, int]:
    bits = code.replace(" ", "")
    mask = int("".join("0" if b == "x" else "1" for b in bits), 2)
    return mask, int(bits.replace("x", "0"), 2)


def test_every_statusword_is_decoded_as_the_standard_codes_it():
    codes = [(*_mask_and_value(code), state) for code, state in CODES.items()]
    for word in range(0x10000):
        named = [state for mask, value, state in codes if word & mask == value]
        assert len(named) <= 1
        assert state_of(word) is (named[0] if named else Cia402State.UNKNOWN), f"0x{word:04X}"


def test_words_agree_with_those_of_the_library():
    theirs = pytest.importorskip("canopen.profiles.p402").State402
    names = {
        Cia402State.NOT_READY: "NOT READY TO SWITCH ON",
        Cia402State.SWITCH_ON_DISABLED: "SWITCH ON DISABLED",
        Cia402State.READY: "READY TO SWITCH ON",
        Cia402State.SWITCHED_ON: "SWITCHED ON",
        Cia402State.OPERATION_ENABLED: "OPERATION ENABLED",
        Cia402State.QUICK_STOP_ACTIVE: "QUICK STOP ACTIVE",
        Cia402State.FAULT_REACTION: "FAULT REACTION ACTIVE",
        Cia402State.FAULT: "FAULT",
    }
    for word in range(0x10000):
        found = [name for name, (mask, bits) in theirs.SW_MASK.items() if word & mask == bits]
        state = state_of(word)
        assert found == ([] if state is Cia402State.UNKNOWN else [names[state]]), f"0x{word:04X}"
    assert theirs.CW_QUICK_STOP == Control.QUICK_STOP
    assert theirs.CW_DISABLE_VOLTAGE == Control.DISABLE_VOLTAGE
    way = (
        Cia402State.SWITCH_ON_DISABLED,
        Cia402State.READY,
        Cia402State.SWITCHED_ON,
        Cia402State.OPERATION_ENABLED,
    )
    for before, after in itertools.pairwise(way):
        assert theirs.TRANSITIONTABLE[names[before], names[after]] == NEXT_CONTROL[before]


def test_the_way_up_has_one_step_from_each_state_and_none_from_a_fault():
    assert NEXT_CONTROL[Cia402State.SWITCH_ON_DISABLED] == 0x06
    assert NEXT_CONTROL[Cia402State.READY] == 0x07
    assert NEXT_CONTROL[Cia402State.SWITCHED_ON] == 0x0F
    assert not {Cia402State.FAULT, Cia402State.FAULT_REACTION, Cia402State.QUICK_STOP_ACTIVE} & set(
        NEXT_CONTROL
    )


def test_frames_are_little_endian_and_signed():
    assert command_bytes(Control.ENABLE_OPERATION, -2) == bytes.fromhex("0F00 FEFFFFFF")
    assert position_of(bytes.fromhex("3706 03 00010000")) == (0x0637, 3, 256)
    assert position_of(bytes.fromhex("3706 FF FFFFFFFF")) == (0x0637, -1, -1)
    assert velocity_of(bytes.fromhex("00000080")) == -(2**31)
    assert inputs_of(bytes.fromhex("01000080")) == 0x80000001
    assert velocity_torque_of(bytes.fromhex("00010000 FFFF")) == (256, -1)
    assert emergency(bytes.fromhex("3081 11 0000000000")) == (0x8130, 0x11)


@pytest.mark.parametrize("decode", [position_of, velocity_of, inputs_of])
@pytest.mark.parametrize("length", [0, 1, 3, 5, 6])
def test_a_frame_of_the_wrong_length_is_none(decode, length):
    assert decode(bytes(length)) is None


@pytest.mark.parametrize(
    ("data", "found"),
    [
        ("", (0x1000, 0)),
        ("30", (0x1000, 0)),
        ("3081", (0x8130, 0)),
        ("308111", (0x8130, 0x11)),
        ("1023 01 00000000", (0x2310, 0x01)),
        ("0000 00 00000000", (0x1000, 0)),  # too short to revoke anything
        ("0000 00 0000000000", (0, 0)),
    ],
)
def test_an_emergency_of_another_length_is_an_emergency(data, found):
    assert emergency(bytes.fromhex(data)) == found


@pytest.mark.parametrize("length", [0, 4, 5, 7, 8])
def test_a_frame_of_velocity_and_torque_has_six_bytes(length):
    assert velocity_torque_of(bytes(length)) is None


def test_the_torque_is_in_the_velocity_frame_and_nothing_else_changes():
    kept = {(o.index, o.subindex): o.value for o in objects(Cia402Settings())}
    found = {(o.index, o.subindex): o.value for o in objects(Cia402Settings(), True)}
    assert {at: found[at] for at in found if found[at] != kept.get(at)} == {
        (0x1A01, 0): 2,
        (0x1A01, 2): 0x6077_0010,
    }


def test_an_expedited_write_is_as_cia_301_writes_it():
    assert sdo_write_bytes(0x6040, 0, 0x0006, 2) == bytes.fromhex("2B 4060 00 06000000")
    assert sdo_write_bytes(0x1016, 1, 0x007F0064, 4) == bytes.fromhex("23 1610 01 64007F00")


def test_an_sdo_answer_is_read_as_cia_301_writes_it():
    assert sdo_read_bytes(0x6041, 0) == bytes.fromhex("40 4160 00 00000000")
    assert sdo_answer(bytes.fromhex("4B 4160 00 37060000")) == (0x6041, 0x0637)
    assert sdo_answer(bytes.fromhex("60 4060 00 00000000")) == (0x6040, None)  # written
    assert sdo_answer(bytes.fromhex("80 4160 00 00000206")) == (0x6041, None)  # aborted
    assert sdo_answer(bytes(7)) is None


def test_identifiers_are_those_of_the_predefined_connection_set():
    assert frames(5) == (0x205, 0x185, 0x285, 0x085, 0x705, 0x605, 0x585, 0x385)


def test_the_longest_frame_is_135_bit_times():
    assert frame_bits(8) == 135  # 111 bits, 21 stuffed at most, 3 between frames
    assert frame_bits(0) == 55
    bits = frame_bits(6) + frame_bits(0) + frame_bits(7) + frame_bits(4)
    assert fastest_tick_rate_hz(1e6) == pytest.approx(0.7e6 / bits)
    assert fastest_tick_rate_hz(1e6) > 1000 > fastest_tick_rate_hz(5e5)


def test_units_are_those_of_the_joint_behind_the_gear():
    settings = Cia402Settings(
        counts_per_rev=4096.0, velocity_units_per_rev_s=60.0, gear_ratio=50.0, sign=-1
    )
    units = scale(settings)
    assert units.counts_per_rad * 2 * math.pi == pytest.approx(-4096 * 50)
    assert units.units_per_rad_s * 2 * math.pi == pytest.approx(-60 * 50)  # rev/min of the motor
    assert units.units_per_rad_s2 > 0


def test_what_is_written_holds_watchdog_mode_and_stop():
    kept = {(o.index, o.subindex): o.value for o in objects(Cia402Settings(drive_watchdog_s=0.1))}
    assert kept[0x1016, 1] == 127 << 16 | 100
    assert kept[0x6060, 0] == 3
    assert kept[0x60FF, 0] == 0
    assert kept[0x6007, 0] == 3
    assert kept[0x605A, 0] == 2
    assert kept[0x1400, 5] == 50


def test_a_mapping_is_changed_while_its_message_is_off():
    order = [(o.index, o.subindex, o.value) for o in objects(Cia402Settings())]
    for index, identifier in ((0x1400, 0x201), (0x1800, 0x181), (0x1801, 0x281)):
        off = order.index((index, 1, 1 << 31 | identifier))
        on = order.index((index, 1, identifier))
        mapped = [k for k, (i, _, _) in enumerate(order) if i == index + 0x200]
        assert off < mapped[0] < mapped[-1] < on
        assert order[mapped[0]][2] == 0  # emptied first, counted last


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"heartbeat_s": 0.1, "drive_watchdog_s": 0.15}, "at least twice heartbeat_s"),
        ({"node_id": 127}, "must differ"),
        ({"sign": 0}, "sign"),
        ({"abort_option": 0}, "abort_option"),
    ],
)
def test_settings_that_cannot_be_safe_are_refused(wrong, said):
    with pytest.raises(ValidationError, match=said):
        Cia402Settings(**wrong)


def test_a_drive_that_is_not_connected_does_nothing_and_says_so():
    drive = Cia402Drive(Cia402Settings(), lambda: 0.0)
    for step in (drive.stop, drive.disable, drive.close, drive.close):
        step()
    assert drive.write(1.0) == 0.0
    assert drive.read().cause == Cause.DRIVE_LOST
    assert math.isnan(drive.read().angle_rad)
    with pytest.raises(DeviceError, match="connect it before"):
        drive.configure()
    with pytest.raises(DeviceError, match="configure it"):
        drive.enable()


def test_a_bus_that_is_not_there_is_said_in_one_sentence():
    drive = Cia402Drive(Cia402Settings(channel="can_none"), lambda: 0.0)
    with pytest.raises(DeviceError, match="node 1 on socketcan can_none: the bus does not open"):
        drive.connect()
