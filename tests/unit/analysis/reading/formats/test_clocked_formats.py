"""NWB, Parquet and Arrow files of other programs: channels by their own clocks, with units."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet
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


def test_nwb_that_breaks_off_is_a_sentence(tmp_path: Path) -> None:
    path = write_nwb(tmp_path / "joint.nwb")
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(UserError, match="is not a complete NWB file"):
        read(path)


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


@pytest.mark.parametrize("kind", ["parquet", "feather", "arrows"])
def test_columns_of_parquet_and_arrow(tmp_path: Path, kind: str) -> None:
    """The unit of a field is in its metadata."""
    time_s = np.arange(2000) / 200.0
    fields = [
        pa.field("time", pa.float64(), metadata={"unit": "s"}),
        pa.field("torque", pa.float64(), metadata={"unit": "N m"}),
        pa.field("angle", pa.float64(), metadata={"unit": "deg"}),
        pa.field("condition", pa.string()),
    ]
    values = [time_s, torque_nm(time_s), np.degrees(angle_rad(time_s)), ["OFF"] * time_s.size]
    table = pa.Table.from_arrays(list(map(pa.array, values)), schema=pa.schema(fields))
    path = tmp_path / f"joint.{kind}"
    if kind == "parquet":
        pa.parquet.write_table(table, path)
    else:
        new = pa.ipc.new_file if kind == "feather" else pa.ipc.new_stream
        with pa.OSFile(str(path), "wb") as file, new(file, table.schema) as writer:
            writer.write_table(table)
    (epoch,) = read(path).epochs
    assert epoch.condition == "OFF"
    np.testing.assert_array_equal(epoch.channels["torque_nm"].values, values[1])
    expected = angle_rad(time_s)
    np.testing.assert_allclose(epoch.channels["angle_rad"].values, expected, atol=1e-15)


def test_parquet_of_pandas_without_units_is_not_guessed(tmp_path: Path) -> None:
    time_s = np.arange(2000) / 200.0
    frame = pd.DataFrame(
        {"time": time_s, "torque": torque_nm(time_s), "angle": np.degrees(angle_rad(time_s))}
    )
    frame.to_parquet(tmp_path / "joint.parquet")
    with pytest.raises(UserError, match="unit"):
        read(tmp_path / "joint.parquet")


def test_clocks_keep_their_rows() -> None:
    one = Stream("a", np.array([0.0, 1.0, 2.0]), {"x": np.array([1.0, 2.0, 3.0])})
    two = Stream("b", np.array([0.5, 1.0]), {"x": np.array([4.0, 5.0]), "y": np.array([6.0, 7.0])})
    table = table_of_streams("file", [one, two], [{"x": "N"}, {"x": "Nm", "y": "deg"}])
    assert table.columns["time_s"].tolist() == [0.0, 0.5, 1.0, 2.0]
    np.testing.assert_array_equal(table.columns["a.x"], [1.0, np.nan, 2.0, 3.0])
    np.testing.assert_array_equal(table.columns["b.x"], [np.nan, 4.0, 5.0, np.nan])
    np.testing.assert_array_equal(table.columns["y"], [np.nan, 6.0, 7.0, np.nan])
    assert table.units == {"time_s": "s", "a.x": "N", "b.x": "Nm", "y": "deg"}


def test_stamps_that_go_back_are_refused() -> None:
    stream = Stream("a", np.array([0.0, 1.0, 0.5]), {"x": np.zeros(3)})
    with pytest.raises(UserError, match="stamps of a do not increase"):
        table_of_streams("file", [stream])
