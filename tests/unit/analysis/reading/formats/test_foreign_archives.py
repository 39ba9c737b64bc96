"""BIDS-Motion and XDF of other programs: a clock for each system, units as they are stated."""

from __future__ import annotations

import shutil
import struct
from pathlib import Path

import numpy as np
import pytest
from tests.archive_files import write_bids_motion, write_xdf
from tests.instrument_files import Signal
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading import read
from rigidimeter.analysis.reading.formats.xdf_check import BOUNDARY
from rigidimeter.core.errors import UserError

TORQUE_S, ANGLE_S = np.arange(2000) / 200.0, np.arange(950) / 100.0
TORQUE = Signal("Torque", "Nm", torque_nm(TORQUE_S))
ANGLE = Signal("Angle", "deg", np.degrees(angle_rad(ANGLE_S)), 100.0)


@pytest.mark.parametrize("latency", [True, False])
def test_a_data_set_with_two_tracking_systems(tmp_path: Path, latency: bool) -> None:
    write_bids_motion(tmp_path / "set", [TORQUE, ANGLE], latency=latency)
    (epoch,) = read(tmp_path / "set").epochs
    angle = epoch.channels["angle_rad"]
    np.testing.assert_allclose(angle.time_s, ANGLE_S, atol=1e-9)
    np.testing.assert_allclose(angle.values, angle_rad(ANGLE_S), rtol=1e-10)
    assert len(epoch.channels["torque_nm"]) == 1899  # as long as both last


def test_one_file_of_a_data_set_is_one_system(tmp_path: Path) -> None:
    write_bids_motion(tmp_path / "set", [TORQUE, ANGLE], latency=True)
    files = sorted((tmp_path / "set").rglob("*_motion.tsv"))
    with pytest.raises(UserError, match="torque_nm"):
        read(files[0])
    (epoch,) = read(files, join=True).epochs
    assert set(epoch.channels) == {"torque_nm", "angle_rad"}


def test_several_recordings_of_a_data_set_are_named(tmp_path: Path) -> None:
    write_bids_motion(tmp_path / "set", [TORQUE], latency=True)
    place = tmp_path / "set" / "sub-01" / "motion"
    for path in list(place.iterdir()):
        (place / path.name.replace("task-elbow", "task-rest")).write_bytes(path.read_bytes())
    with pytest.raises(UserError, match=r"has 2 motion recordings .*task-rest"):
        read(tmp_path / "set")


def test_events_with_a_column_epoch_are_the_epochs_of_a_folder(tmp_path: Path) -> None:
    """1 to 4 s counts, 5 to 8 s does not; a button press says of no epoch that it is one."""
    write_bids_motion(tmp_path / "set", [TORQUE, ANGLE], latency=True)
    shutil.copytree(tmp_path / "set" / "sub-01", tmp_path / "set" / "sub-02")
    events = tmp_path / "set" / "sub-02" / "motion" / "sub-01_task-elbow_events.tsv"
    rows = ["onset\tduration\tepoch\tcondition\texcluded", "1\t3\tA\tOFF\tfalse"]
    rows += ["2\t0\tn/a\tn/a\tn/a", "5\t3\tB\tOFF\ttrue"]
    events.write_text("\n".join(rows) + "\n")
    (epoch,) = read(tmp_path / "set" / "sub-02").epochs
    assert (epoch.label, epoch.condition) == ("A", "OFF")
    torque = epoch.channels["torque_nm"]
    assert (torque.time_s[0], torque.time_s[-1]) == (1.0, 4.0)
    events.write_text("onset\tduration\n1\t0\n")
    (epoch,) = read(tmp_path / "set" / "sub-02").epochs
    assert len(epoch.channels["torque_nm"]) == 1899
    events.write_text("onset\tduration\tepoch\nsoon\t3\tA\n")
    with pytest.raises(UserError, match=r"events\.tsv: an event has no number as onset"):
        read(tmp_path / "set" / "sub-02")


def test_a_data_set_without_a_rate_is_refused(tmp_path: Path) -> None:
    write_bids_motion(tmp_path / "set", [TORQUE], latency=False)
    for path in (tmp_path / "set").rglob("*_motion.json"):
        path.unlink()
    with pytest.raises(UserError, match="states no SamplingFrequency"):
        read(tmp_path / "set")


def test_clock_offsets_of_an_xdf_file_are_applied(tmp_path: Path) -> None:
    """The second computer's clock is 0.4 s ahead, and the file says so every 5 s."""
    write_xdf(tmp_path / "r.xdf", [TORQUE, ANGLE], offset_s=0.4)
    (epoch,) = read(tmp_path / "r.xdf").epochs
    angle = epoch.channels["angle_rad"]
    np.testing.assert_allclose(angle.time_s, ANGLE_S, atol=1e-6)
    np.testing.assert_allclose(angle.values, angle_rad(ANGLE_S), rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("at", "written", "said"),
    [
        (struct.pack("<BI", 4, 2000), b"\x04\xff\xff\xff\x7f", "holds 2147483647 samples"),
        (b"XDF:\x04", b"XDF:\x04\xff\xff\xff\x7f", "damaged length"),
    ],
)
def test_a_damaged_count_or_length_of_xdf_is_refused(tmp_path, at, written, said) -> None:
    """Before anybody makes room for it."""
    path = tmp_path / "r.xdf"
    write_xdf(path, [TORQUE, ANGLE])
    data = bytearray(path.read_bytes())
    place = data.index(at)
    data[place : place + len(written)] = written
    path.write_bytes(data + struct.pack("<BIH", 4, 18, 5) + BOUNDARY)
    with pytest.raises(UserError, match=said):
        read(path)
