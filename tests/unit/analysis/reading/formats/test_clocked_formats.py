"""Trials of NWB, what is not read beside a file, and stamps that go back."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading import read
from rigidimeter.analysis.reading.formats.clocked_table import Stream, table_of_streams
from rigidimeter.core.errors import UserError

TORQUE_S = np.arange(2000) / 200.0
ANGLE_S = 0.0013 + np.arange(1000) / 100.0


def write_nwb(path: Path, unit: str = "degrees", intervals: str = "trial") -> Path:
    """Write torque at 200 Hz with a rate, angle at 100 Hz with stamps, and two intervals."""
    pynwb = pytest.importorskip("pynwb")
    from pynwb.behavior import Position, SpatialSeries

    file = pynwb.NWBFile("a joint", "one", datetime(2026, 3, 1, tzinfo=UTC))
    series = pynwb.TimeSeries(
        name="Torque", data=torque_nm(TORQUE_S), unit="N*m", starting_time=0.0, rate=200.0
    )
    file.add_acquisition(series)
    angle = SpatialSeries(
        name="Angle",
        data=np.degrees(angle_rad(ANGLE_S)),
        unit=unit,
        timestamps=ANGLE_S,
        reference_frame="rest",
    )
    module = file.create_processing_module("behavior", "motion")
    module.add(Position(spatial_series=angle))
    for start_s in (0.0, 5.0):
        getattr(file, f"add_{intervals}")(start_time=start_s, stop_time=start_s + 4.5)
    with pynwb.NWBHDF5IO(path, "w") as io:
        io.write(file)
    return path


@pytest.mark.parametrize("intervals", ["trial", "epoch"])
def test_nwb_of_another_program(tmp_path: Path, intervals: str) -> None:
    """Units and intervals are taken from the file, and each series keeps its clock."""
    found = read(write_nwb(tmp_path / "joint.nwb", intervals=intervals))
    assert [epoch.label for epoch in found.epochs] == ["1", "2"]
    channels = found.epochs[0].channels
    within = TORQUE_S <= 4.5
    np.testing.assert_allclose(channels["torque_nm"].time_s, TORQUE_S[within], atol=1e-12)
    np.testing.assert_array_equal(channels["torque_nm"].values, torque_nm(TORQUE_S)[within])
    within = ANGLE_S <= 4.5
    np.testing.assert_array_equal(channels["angle_rad"].time_s, ANGLE_S[within])
    expected = angle_rad(ANGLE_S)[within]
    np.testing.assert_allclose(channels["angle_rad"].values, expected, rtol=1e-12, atol=1e-15)


def test_nwb_reads_nothing_beside_the_file(tmp_path: Path) -> None:
    """Data that a file keeps elsewhere, or that a link takes from elsewhere, are not its own."""
    h5py = pytest.importorskip("h5py")
    path = write_nwb(tmp_path / "joint.nwb")
    other = write_nwb(tmp_path / "other.nwb")
    with h5py.File(path, "a") as file:
        del file["acquisition/Torque"]
        file["acquisition/Torque"] = h5py.ExternalLink(str(other), "/acquisition/Torque")
    with pytest.raises(UserError, match=r"(?i)torque"):
        read(path)


def test_stamps_that_go_back_are_refused() -> None:
    stream = Stream("a", np.array([0.0, 1.0, 0.5]), {"x": np.zeros(3)})
    with pytest.raises(UserError, match="stamps of a do not increase"):
        table_of_streams("file", [stream])
