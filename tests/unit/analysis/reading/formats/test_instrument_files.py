"""Files of instruments: each channel with its own clock and unit, as the program wrote them."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.instrument_files import (
    WRITERS,
    Signal,
    write_acq,
    write_smr,
    write_tdms,
    write_tdms_columns,
)
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading import read
from rigidimeter.analysis.reading.formats import read_table
from rigidimeter.core.errors import UserError

TORQUE_S = np.arange(2000) / 200.0
ANGLE_S = np.arange(1000) / 100.0
TORQUE = Signal("Torque", "N m", torque_nm(TORQUE_S))
ANGLE = Signal("Angle", "deg", np.degrees(angle_rad(TORQUE_S)))
SLOW_ANGLE = Signal("Angle", "deg", np.degrees(angle_rad(ANGLE_S)), 100.0)
LATE_ANGLE = Signal("Angle", "deg", np.degrees(angle_rad(ANGLE_S + 0.25)), 100.0, 0.25)
"""Largest rounding by the format: 32-bit floats, or 16-bit numbers over the range (here ±11°)."""
EXTRAS = {".tdms": "tdms", ".c3d": "c3d", ".acq": "biopac", ".smr": "neo"}


@pytest.mark.parametrize(
    ("name", "write", "late"),
    [
        ("waveforms.tdms", write_tdms, True),
        ("groups.tdms", write_tdms_columns, True),
        ("joint.acq", write_acq, False),
        ("joint.smr", write_smr, True),
    ],
)
def test_a_channel_keeps_its_clock(tmp_path, name, write, late) -> None:
    """A slower angle, that in some formats starts later, has its samples at their own times."""
    angle = LATE_ANGLE if late else SLOW_ANGLE
    write(tmp_path / name, [TORQUE, angle])
    (epoch,) = read(tmp_path / name).epochs
    torque = epoch.channels["torque_nm"]  # as long as the angle lasts
    within = TORQUE_S[angle.start_s <= TORQUE_S]
    np.testing.assert_allclose(torque.time_s, within, atol=1e-9)
    np.testing.assert_allclose(torque.values, torque_nm(TORQUE_S)[-within.size :], atol=1e-7)
    found = epoch.channels["angle_rad"]
    kept = angle.time_s[angle.time_s <= TORQUE_S[-1]]
    np.testing.assert_allclose(found.time_s, kept, atol=1e-9)
    np.testing.assert_allclose(found.values, angle_rad(kept), atol=1e-7)


def test_a_64_bit_file_of_spike2_has_a_way_on_without_sonpy(tmp_path: Path, monkeypatch) -> None:
    """That package cannot be installed everywhere, so its name alone would not help."""
    pytest.importorskip("neo")
    monkeypatch.setitem(sys.modules, "sonpy", None)
    path = tmp_path / "joint.smrx"
    path.write_bytes(b"S64" + bytes(5000))
    with pytest.raises(UserError, match=r"CED's sonpy.*export it as a 32-bit file \(\.smr\)"):
        read(path)


def test_a_pause_of_a_plexon_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "joint.plx"
    WRITERS[".plx"](path, [TORQUE])
    data = path.read_bytes()
    at = data.rindex(struct.pack("<HHI", 5, 0, 200_000))  # the second block, after 5 s
    path.write_bytes(data[:at] + struct.pack("<HHI", 5, 0, 240_000) + data[at + 8 :])
    with pytest.raises(UserError, match="channel Torque was paused"):
        read(path)


def test_a_compressed_channel_does_not_fill_the_memory(tmp_path: Path) -> None:
    """Half a gigabyte of zeros takes half a megabyte in the file."""
    zeros = Signal("Torque", "Nm", np.zeros(2**24 + 1))
    path = tmp_path / "joint.acq"
    write_acq(path, [zeros], compressed=True)
    assert path.stat().st_size < 2**20
    with pytest.raises(UserError, match=r"expands to .* so split"):
        read(path)


def test_two_channels_of_one_name_keep_their_units(tmp_path: Path) -> None:
    """The raw and the calibrated torque: neither has the unit of the other."""
    from nptdms import ChannelObject, TdmsWriter

    wave = {"wf_increment": 0.005, "wf_start_offset": 0.0}
    with TdmsWriter(str(tmp_path / "joint.tdms")) as writer:
        writer.write_segment(
            [
                ChannelObject(group, "Torque", TORQUE.values, wave | {"unit_string": unit})
                for group, unit in (("raw", "V"), ("calibrated", "Nm"))
            ]
        )
    table = read_table(tmp_path / "joint.tdms")
    assert table.units == {"time_s": "s", "raw.Torque": "V", "calibrated.Torque": "Nm"}


def test_a_spectrum_is_no_signal_in_time(tmp_path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    spectrum = {"wf_increment": 0.1, "wf_xunit_string": "Hz", "unit_string": "Nm"}
    wave = {"wf_increment": 0.005, "wf_start_offset": 0.0, "unit_string": "Nm"}
    with TdmsWriter(str(tmp_path / "joint.tdms")) as writer:
        writer.write_segment(
            [
                ChannelObject("a", "Torque", TORQUE.values, wave),
                ChannelObject("a", "Torque spectrum", TORQUE.values, spectrum),
            ]
        )
    table = read_table(tmp_path / "joint.tdms")
    assert list(table.columns) == ["time_s", "Torque"]
    assert table.others == {"a.Torque spectrum": "a channel that is no waveform"}


def test_c3d_with_counts_and_scales(tmp_path: Path) -> None:
    """Channels of integers have a scale, an offset and a general scale, as Vicon writes them."""
    c3d = pytest.importorskip("c3d")
    writer = c3d.Writer(point_rate=100, analog_rate=200, point_scale=-1.0)
    writer.set_point_labels(["ELB"])
    writer.set_analog_labels(["Torque"])
    writer.analog_group.add_str("UNITS", "", "Nm  ", 4, 1)
    writer.set_analog_general_scale(0.5)
    writer.set_analog_scales([0.002])
    writer.set_analog_offsets([20])
    for pair in TORQUE.values.astype(np.float32).reshape(-1, 1, 2):
        frame = np.empty((1, 2), dtype=object)
        frame[0, 0], frame[0, 1] = np.zeros((1, 5), np.float32), pair
        writer.add_frames(frame)
    with (tmp_path / "joint.c3d").open("wb") as file:
        writer.write(file)
    stored = np.frombuffer((tmp_path / "joint.c3d").read_bytes()[-512:], "<f4")
    assert np.max(np.abs(stored)) > 20  # counts about the offset, not newton metres
    table = read_table(tmp_path / "joint.c3d")
    np.testing.assert_allclose(table.columns["Torque"], TORQUE.values, rtol=0, atol=1e-4)
    assert table.units["Torque"] == "Nm"


def test_c3d_of_markers_alone_is_a_sentence(tmp_path: Path) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["ELB"]
    file["data"]["points"] = np.zeros((4, 1, 200))
    file.write(str(tmp_path / "joint.c3d"))
    with pytest.raises(UserError, match=r"holds no analogue channel; torque and angle"):
        read(tmp_path / "joint.c3d")


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_file_that_breaks_off_is_a_sentence(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"joint{suffix}"
    WRITERS[suffix](path, [TORQUE, ANGLE])
    path.write_bytes(path.read_bytes()[:700])
    with pytest.raises(UserError, match=r"joint\.\w+ (is not a complete|holds no|has neither)"):
        read(path)


@pytest.mark.parametrize("suffix", EXTRAS)
def test_a_missing_package_is_named(tmp_path: Path, monkeypatch, suffix: str) -> None:
    path = tmp_path / f"joint{suffix}"
    WRITERS[suffix](path, [TORQUE, ANGLE])
    for name in ("nptdms", "c3d", "bioread", "bioread.reader", "neo"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(UserError, match=rf"pip install 'rigidimeter\[{EXTRAS[suffix]}\]'"):
        read(path)


def test_spike2_that_claims_more_blocks_than_it_has_is_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "joint.smr"
    write_smr(path, [TORQUE])
    data = bytearray(path.read_bytes())
    data[30:32], data[526:528] = (3).to_bytes(2, "little"), (32767).to_bytes(2, "little")
    path.write_bytes(data)
    with pytest.raises(UserError, match="32767 blocks of data are not in it"):
        read(path)
