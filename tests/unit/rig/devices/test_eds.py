"""What fits a drive, by its EDS, and what the driver accepts of one that is not quite the same."""

from __future__ import annotations

import pytest

from rigidimeter.cli.commission import commission
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.devices import (
    Cia402Settings,
    DriveSays,
    Object,
    bound_objects,
    compare_eds,
    displayed_mode,
    drive_bounds,
    objects,
    read_back,
    wanted_bounds,
    write_bounds,
    write_object,
)
from rigidimeter.rig.devices.base import DeviceError

canopen = pytest.importorskip("canopen")

SIGNED = {1: 0x02, 2: 0x03, 4: 0x04}
UNSIGNED = {1: 0x05, 2: 0x06, 4: 0x07}
MEASURED = ((0x6041, 2), (0x6064, 4), (0x606C, 4))
MAPPING = range(0x1600, 0x1B00)


def eds(tmp_path, settings=None, without=(), held=(), **changes):
    """Write the EDS of a drive with all that the driver needs, but for the changes.

    `changes` are keys of a section, by index and sub-index as in o1016_1.
    """
    settings = settings or Cia402Settings()
    entries = {(o.index, o.subindex): o for o in objects(settings)}
    read = [Object("", 0x1000, 0, 4, 0), Object("", 0x1018, 1, 4, 0), displayed_mode(settings)]
    read += [Object("", *settings.axis(index), size, 0) for index, size in MEASURED]
    entries.update({(o.index, o.subindex): o for o in (*read, *held)})
    text, named = "[DeviceInfo]\nBaudRate_1000=1\n\n", set()
    for (index, subindex), entry in sorted(entries.items()):
        if index in without or (index, subindex) in without:
            continue
        several = any(i == index and s for i, s in entries)
        if several and index not in named:
            named.add(index)
            text += f"[{index:04X}]\nParameterName=record\nObjectType=0x9\nSubNumber=2\n\n"
        section = f"{index:04X}sub{subindex:X}" if several else f"{index:04X}"
        keys = {
            "ParameterName": "object",
            "ObjectType": "0x7",
            "DataType": (SIGNED if entry.signed else UNSIGNED)[entry.size],
            "AccessType": "rw",
            "PDOMapping": int(index >= 0x6000),
        }
        keys.update(changes.get(f"o{index:04X}_{subindex}", {}))
        text += f"[{section}]\n" + "".join(f"{k}={v}\n" for k, v in keys.items()) + "\n"
    path = tmp_path / "drive.eds"
    path.write_text(text)
    return path


def wrong(path, settings=None):
    found = compare_eds(path, settings or Cia402Settings())
    return {row.label: row.found for row in found if not row.fits}


def test_a_drive_with_all_objects_fits(tmp_path, capsys):
    path = eds(tmp_path, without=(0x607F, (0x1400, 5), 0x1401, 0x1803))
    assert wrong(path) == {}
    commission(None, None, eds=path)
    shown = capsys.readouterr().out
    assert "max profile velocity (0x607F:00)" in shown
    assert "optional" in shown
    assert "Every object fits." in shown
    assert "Without max profile velocity (0x607F:00): a target that this program" in shown
    assert "Without max torque (0x6072:00): between two ticks the drive gives all the" in shown


def test_bounds_of_another_size_do_not_fit(tmp_path):
    settings, bounds = Cia402Settings(), drive_bounds(parse_settings({}))
    path = eds(tmp_path, held=bound_objects(settings, bounds), o6072_0={"DataType": "0x7"})
    found = {row.label: row for row in compare_eds(path, settings, bounds)}
    assert {label: row.found for label, row in found.items() if not row.fits} == {
        "max torque (0x6072:00)": "32 bits"
    }
    assert found["max slippage (0x60F8:00)"].fits


@pytest.mark.parametrize(
    ("without", "changes", "label", "found"),
    [
        ((0x1016,), {}, "heartbeat watchdog (0x1016:01)", "no such object"),
        (((0x1016, 1),), {}, "heartbeat watchdog (0x1016:01)", "no such object"),
        ((0x6007,), {}, "abort-connection option (0x6007:00)", "no such object"),
        ((), {"o6007_0": {"AccessType": "ro"}}, "abort-connection option (0x6007:00)", "ro"),
        ((), {"o6085_0": {"HighLimit": "1000"}}, "quick-stop deceleration (0x6085:00)", "1000"),
        ((), {"o60FF_0": {"DataType": "0x3"}}, "target velocity (0x60FF:00)", "16 bits"),
        ((), {"o606C_0": {"PDOMapping": 0}}, "0x606C:00 in a frame", "not to be mapped"),
        ((0x6064,), {}, "0x6064:00 in a frame", "no such object"),
        ((0x6061,), {}, "mode of operation display (0x6061:00)", "no such object"),
        ((), {"o1800_2": {"AccessType": "ro", "DefaultValue": 255}}, "0x1800:02", "0xFF"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path, without, changes, label, found):
    said = wrong(eds(tmp_path, without=without, **changes))
    assert any(label in name and found in text for name, text in said.items()), said
    with pytest.raises(UserError, match=r"drive\.eds: does not fit: "):
        commission(None, None, eds=tmp_path / "drive.eds")


TORQUE = {
    (0x6076, 0): ("0x7", "ro", 0),
    (0x6077, 0): ("0x3", "ro", 1),
    (0x1A01, 2): ("0x7", "rw", 0),
}


def with_torque(path, without=(), **changes):
    """Add the objects of the drive's torque to an EDS."""
    text = path.read_text()
    for address, (kind, access, mappable) in TORQUE.items():
        index, subindex = address
        if index in without:
            continue
        section = f"{index:04X}sub{subindex}" if subindex else f"{index:04X}"
        keys = {"ParameterName": "torque", "ObjectType": "0x7", "DataType": kind}
        keys |= {"AccessType": access, "PDOMapping": mappable}
        keys |= changes.get(f"o{index:04X}", {})
        text += f"[{section}]\n" + "".join(f"{k}={v}\n" for k, v in keys.items()) + "\n"
    path.write_text(text)
    return path


def rows(path, **settings):
    return {row.label: row for row in compare_eds(path, Cia402Settings(**settings))}


def test_a_drive_that_reports_its_torque_has_it_in_the_velocity_frame(tmp_path):
    found = rows(with_torque(eds(tmp_path)))
    assert all(row.fits for row in found.values())
    assert found["0x6077:00 in a frame"][:4] == ("0x6077:00 in a frame", True, "16 bits", "16 bits")
    assert "velocity frame's entry 2 (0x1A01:02)" in found
    assert "0x6077:00 in a frame" not in rows(tmp_path / "drive.eds", reads_torque=False)


@pytest.mark.parametrize(
    ("change", "label", "found"),
    [
        ({"without": (0x6076,)}, "motor rated torque (0x6076:00)", "no such object"),
        ({"without": (0x6077,)}, "actual torque (0x6077:00)", "no such object"),
        ({"without": (0x1A01,)}, "velocity frame's entry 2 (0x1A01:02)", "no such sub-index"),
        ({"o6077": {"PDOMapping": 0}}, "0x6077:00 in a frame", "16 bits, not to be mapped"),
        ({"o6077": {"DataType": "0x4"}}, "0x6077:00 in a frame", "32 bits"),
    ],
)
def test_a_drive_without_its_torque_fits_and_says_what_lacks(tmp_path, change, label, found):
    path = with_torque(eds(tmp_path), **change)
    assert wrong(path) == {}
    assert rows(path)[label][:4] == (label, True, found, "optional")
    assert "0x6077:00 in a frame" not in rows(path) or label == "0x6077:00 in a frame"


def test_a_fixed_mapping_fits_if_it_is_what_is_needed(tmp_path):
    fixed = {
        f"o{o.index:04X}_{o.subindex}": {"AccessType": "const", "DefaultValue": o.value}
        for o in objects(Cia402Settings())
        if o.index in MAPPING
    }
    assert wrong(eds(tmp_path, **fixed)) == {}
    fixed["o1A00_2"]["DefaultValue"] = 0x60780010
    assert list(wrong(eds(tmp_path, **fixed))) == ["position frame's entry 2 (0x1A00:02)"]


@pytest.mark.parametrize("axis", [{"axis_offset": 0x800}, {"axis_subindex": 2}])
def test_an_axis_has_its_own_objects(tmp_path, axis):
    settings = Cia402Settings(**axis)
    of_axis = {(o.index, o.subindex) for o in objects(settings) if o.index >= 0x6000}
    index = 0x6040 + axis.get("axis_offset", 0)
    assert (index, axis.get("axis_subindex", 0)) in of_axis
    assert not of_axis & {(o.index, o.subindex) for o in objects(Cia402Settings())}
    mapped = [o.value for o in objects(settings) if o.name == "command frame's entry 1"]
    assert mapped == [index << 16 | axis.get("axis_subindex", 0) << 8 | 16]
    path = eds(tmp_path, settings)
    assert wrong(path, settings) == {}
    assert "controlword (0x6040:00)" in wrong(path)


@pytest.mark.parametrize(
    "text", ["", "[DeviceInfo]\n", "no EDS", "[6040]\nParameterName=x\n", "[1000"]
)
def test_a_file_that_is_no_eds_is_refused_in_one_sentence(tmp_path, text):
    path = tmp_path / "other.txt"
    path.write_text(text)
    with pytest.raises(UserError, match=r"other\.txt: (is no EDS|cannot be read as an EDS)"):
        commission(None, None, eds=path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
def test_an_eds_in_any_usual_encoding_is_read(tmp_path, capfd, encoding):
    path = eds(tmp_path)
    path.write_text("[FileInfo]\nCreatedBy=Müller\n\n" + path.read_text(), encoding=encoding)
    assert wrong(path) == {}
    assert capfd.readouterr().err == ""


def test_an_eds_that_is_not_there_is_no_damaged_one(tmp_path):
    with pytest.raises(
        UserError, match=r"none\.eds: (there is no such file|cannot be read)"
    ) as told:
        wrong(tmp_path / "none.eds")
    assert "as an EDS" not in str(told.value)


def test_a_rig_file_or_an_eds_is_needed():
    with pytest.raises(UserError, match=r"--rig RIG\.toml, or a drive's EDS with --eds FILE"):
        commission(None, None, eds=None)


class Drive:
    """An SDO server whose objects may be missing, or may not be written."""

    def __init__(self, values, absent=(), fixed=()):
        self.values, self.absent, self.fixed = values, absent, fixed

    def download(self, index, subindex, data):
        if index in self.absent:
            raise canopen.SdoAbortedError(0x06020000)
        if index in self.fixed:
            raise canopen.SdoAbortedError(0x06010002)
        self.values[index, subindex] = bytes(data)

    def upload(self, index, subindex):
        if (index, subindex) not in self.values:
            raise canopen.SdoAbortedError(0x06020000)
        return self.values[index, subindex]


def written(drive):
    """Write and read back as the driver does; return what the drive does not have."""
    needed = objects(Cia402Settings())
    absent = [entry.index for entry in needed if not write_object(drive, entry, "drive")]
    read_back(drive, needed, "drive")
    return absent


def last_values():
    return {
        (o.index, o.subindex): o.value.to_bytes(o.size, "little", signed=o.signed)
        for o in objects(Cia402Settings())
    }


def test_a_mapping_that_refuses_to_be_written_is_accepted_if_it_is_as_needed():
    fixed = (0x1400, 0x1800, 0x1801, 0x1600, 0x1A00, 0x1A01)
    drive = Drive(last_values(), fixed=fixed[1:])
    assert written(drive) == []
    drive.values[0x1A01, 1] = (0x60780010).to_bytes(4, "little")
    with pytest.raises(DeviceError, match=r"velocity frame's entry 1 .* must be"):
        written(drive)


@pytest.mark.parametrize(
    ("units", "name"),
    [
        ({"velocity_units_per_rev_s": 1e9}, r"max profile velocity \(0x607F:00\)"),
        ({"motor_speed_units_per_rev_s": 1e9}, r"max motor speed \(0x6080:00\)"),
    ],
)
def test_a_value_that_its_object_has_no_room_for_is_refused_in_one_sentence(units, name):
    settings, bounds = Cia402Settings(**units), drive_bounds(parse_settings({}))
    entries = (*objects(settings), *bound_objects(settings, bounds))
    with pytest.raises(DeviceError, match=rf"{name} = \d+ does not fit into its 4 bytes"):
        all(write_object(Drive({}), entry, "drive") for entry in entries)


class Ordered(Drive):
    """Its upper position limit must never be below its lower one."""

    def download(self, index, subindex, data):
        before = dict(self.values)
        super().download(index, subindex, data)
        low, high = (int.from_bytes(self.values[0x607D, k], "little", signed=True) for k in (1, 2))
        if low > high:
            self.values = before
            raise canopen.SdoAbortedError(0x06090036)


@pytest.mark.parametrize("position_counts", [0, 500_000, -500_000])
def test_position_limits_of_before_do_not_keep_out_those_of_now(position_counts):
    """The person before sat elsewhere, so that both new limits are beyond one of the old ones."""
    before = {(0x607D, 1): -1000, (0x607D, 2): 1000}
    drive = Ordered({at: value.to_bytes(4, "little", signed=True) for at, value in before.items()})
    wanted = wanted_bounds(
        Cia402Settings(),
        drive_bounds(parse_settings({})),
        DriveSays(position_counts, None, None),
    )
    _, entries = write_bounds(drive, wanted, "drive")
    ends = [entry for entry in entries if entry.index == 0x607D]
    assert [entry.subindex for entry in ends] == [1, 2]
    assert read_back(drive, ends, "drive")


def test_max_profile_velocity_is_optional_and_the_watchdog_is_not():
    assert written(Drive({}, absent=(0x607F,))) == [0x607F]
    for index in (0x1016, 0x6007):
        with pytest.raises(DeviceError, match="0x06020000; the drive has no such object"):
            written(Drive({}, absent=(index,)))
        with pytest.raises(DeviceError, match="0x06010002; the settings must name a value"):
            written(Drive({}, fixed=(index,)))
