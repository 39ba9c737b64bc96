"""A rig is locked by what it is, for the whole machine, whatever its file is called."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.rig.devices import RigLock, load_rig, lock_path
from rigidimeter.rig.devices.base import DeviceFacts


@pytest.fixture(autouse=True)
def folder(tmp_path_factory, monkeypatch):
    made = tmp_path_factory.mktemp("locks")
    made.chmod(0o1777)
    monkeypatch.setattr("rigidimeter.rig.devices.rig_lock.FOLDERS", (made,))
    return made


def rig(path, *, address="127.0.0.1", sensor_port=50001, drive="", name="rig"):
    drive = drive or 'driver = "ascii"\nport = "/dev/no-such"\ncounts_per_turn = 1000'
    path.write_text(
        f'name = "{name}"\n[torque_sensor]\ndriver = "ati-rdt"\naddress = "{address}"\n'
        f"port = {sensor_port}\n[drive]\n{drive}\n"
    )
    return load_rig(path)


CLAIM = """
import sys
from pathlib import Path
from rigidimeter.rig.devices import rig_lock
from rigidimeter.rig.devices.rigfile import load_rig
rig_lock.FOLDERS = (Path(sys.argv[2]),)
claim = load_rig(Path(sys.argv[1])).claim()
print("has it", flush=True)
sys.stdin.read()
"""


def test_a_copy_of_the_file_does_not_take_the_rig(tmp_path, folder):
    mine = rig(tmp_path / "rig.toml")
    copy = rig(tmp_path / "copy.toml", name="a copy")  # to read it is no claim
    other = subprocess.Popen(
        [sys.executable, "-c", CLAIM, str(copy.path), str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert other.stdout is not None
    assert other.stdout.readline() == "has it\n"
    said = (
        rf"rig\.toml: another program uses this rig \(process {other.pid}\), locked by its "
        r"torque sensor at 127\.0\.0\.1:50001; end that one first"
    )
    with pytest.raises(UserError, match=said):
        mine.claim()
    other.kill()  # the claim goes with the process, however it ends
    other.communicate()
    with mine.claim():
        pass
    mine.claim().close()  # and with the lock


@pytest.mark.parametrize(
    "changed",
    [
        {"drive": 'driver = "ascii"\nport = "/dev/other"\ncounts_per_turn = 9'},  # one sensor
        {"address": "localhost", "drive": 'driver = "ascii"\nport = "/dev/x"\ncounts_per_turn = 9'},
        {"sensor_port": 50002},  # one drive
    ],
    ids=str,
)
def test_rigs_that_share_a_device_are_not_used_at_once(tmp_path, changed):
    first, second = rig(tmp_path / "a.toml"), rig(tmp_path / "b.toml", **changed)
    with first.claim(), pytest.raises(UserError, match=f"process {os.getpid()}"):
        second.claim()
    with second.claim():
        pass


def test_a_port_has_one_lock_under_all_its_names(tmp_path):
    link = tmp_path / "by-id"
    link.symlink_to("/dev/no-such")
    drive = f'driver = "ascii"\nport = "{link}"\ncounts_per_turn = 9'
    first, second = rig(tmp_path / "a.toml"), rig(tmp_path / "b.toml", sensor_port=1, drive=drive)
    with first.claim(), pytest.raises(UserError, match="locked by its serial port /dev/no-such"):
        second.claim()


def can(node, interface="kvaser", channel="0", more=""):
    return f'driver = "cia402"\ninterface = "{interface}"\nchannel = {channel}\n' + (
        f"node_id = {node}\n{more}"
    )


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (can(1), can(1, channel='"0"'), True),
        (can(1), can(1, more="sign = -1"), True),
        (can(1), can(2), False),
        (can(1), can(1, channel="1"), False),
        (can(1, "udp_multicast", '"g"'), can(1, "udp_multicast", '"g"', "port = 4"), False),
        (can(1, "virtual"), can(1, "virtual"), False),  # a bus within the process
    ],
)
def test_a_drive_on_a_bus_is_its_bus_and_node(tmp_path, one, other, same):
    first = rig(tmp_path / "a.toml", drive=one)
    second = rig(tmp_path / "b.toml", sensor_port=2, drive=other)
    with first.claim():
        if same:
            with pytest.raises(UserError, match="locked by its node 1 on kvaser 0"):
                second.claim()
        else:
            second.claim().close()


def test_a_refused_claim_keeps_nothing(tmp_path):
    first = rig(tmp_path / "a.toml", sensor_port=3)
    with first.claim():
        with pytest.raises(UserError, match="serial port"):
            rig(tmp_path / "b.toml", sensor_port=4).claim()
        drive = 'driver = "ascii"\nport = "/dev/x"\ncounts_per_turn = 9'
        rig(tmp_path / "c.toml", sensor_port=4, drive=drive).claim().close()


def test_a_device_with_two_addresses_is_told_by_its_serial_number(tmp_path):
    a, b = (rig(tmp_path / f"{k}.toml", address=f"192.0.2.{k}") for k in (1, 2))
    facts = {"torque_sensor": DeviceFacts("Net F/T", "FT1", 1000.0)}
    with a.claim() as lock, RigLock(b.path) as other:
        a.build(lambda: 0.0, 50.0, lock=lock)._identified(facts)
        second = b.build(lambda: 0.0, 50.0, lock=other)
        with pytest.raises(UserError, match="its torque sensor, serial number FT1"):
            second._identified(facts)


def test_emulated_devices_may_bear_the_same_serial_number(tmp_path):
    mine = rig(tmp_path / "rig.toml")
    facts = {"torque_sensor": DeviceFacts("Net F/T", "FT1", 1000.0)}
    with RigLock(mine.path) as lock, RigLock(mine.path) as other:
        for each in (lock, other):
            mine.build(lambda: 0.0, 50.0, lock=each)._identified(facts)


def test_a_lock_is_for_every_user_and_stays_in_place(tmp_path):
    before = os.umask(0o077)
    try:
        rig(tmp_path / "rig.toml").claim().close()
    finally:
        os.umask(before)
    path = lock_path("serial port /dev/no-such")
    assert path.stat().st_mode & 0o777 == 0o666
    assert path.read_text() == f"{os.getpid()}\n"


def test_a_link_in_place_of_a_lock_is_not_followed(tmp_path):
    target = tmp_path / "precious"
    target.write_text("precious")
    lock_path("serial port /dev/no-such").symlink_to(target)
    with pytest.raises(UserError, match=r"the lock of serial port /dev/no-such cannot be opened"):
        rig(tmp_path / "rig.toml").claim()
    assert target.read_text() == "precious"


def test_a_machine_without_a_folder_for_every_user_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("rigidimeter.rig.devices.rig_lock.FOLDERS", (tmp_path, Path("/no/such")))
    with pytest.raises(UserError, match=r"none of .*, /no/such is a folder that every user can"):
        rig(tmp_path / "rig.toml").claim()
