"""Tables, timetables and objects of classes of MATLAB files."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from tests.matlab_files import save, table, timetable

from rigidimeter.analysis.reading.channels.channels_of_table import channels_of_table
from rigidimeter.analysis.reading.formats import ReadOptions, mat_file
from rigidimeter.analysis.reading.formats.mat_file import read_mat
from rigidimeter.analysis.reading.formats.text_head import Layout
from rigidimeter.core.errors import UserError

pytest.importorskip("matio")
MATLAB = Path(__file__).with_name("matlab")
VERSIONS = ("v7", "v7.3")
COLUMNS = {"torque": np.array([0.5, 1.0, 1.5]), "angle": np.array([2.0, 4.0, 6.0])}
UNITS = ("N*m", "deg")


@pytest.fixture(autouse=True)
def _silent(recwarn: pytest.WarningsRecorder) -> None:
    """The writer warns of the resolution in which it keeps times."""


def test_a_table_that_matlab_saved() -> None:
    found = read_mat(MATLAB / "table.mat")
    assert list(found.columns["T1.Var2"]) == [4.4, 5.5, 6.6]
    assert list(found.columns["T2.Var1"]) == ["apple", "banana", "cherry"]
    assert list(found.columns["T3.Time"]) == [0.0, 86400.0, 172800.0]
    assert list(found.columns["T3.Duration"]) == [30.0, 60.0, 90.0]
    assert list(found.columns["T10.data_2"]) == [4.0, 5.0, 6.0]  # the matrix is split
    assert found.units["T9.Label"] == "category"
    assert found.units["T3.Duration"] == "s"
    assert found.others["T4.C"] == "an array of objects"


@pytest.mark.parametrize(
    ("name", "time_s"),
    [
        ("tt1", [0.0, 86400.0, 172800.0]),  # dates
        ("tt2", [10.0, 20.0, 30.0]),  # durations
        ("tt4", [0.0, 1e-4, 2e-4]),  # 10,000 samples/s
        ("tt5", [0.0, 1.0, 2.0]),  # a step
        ("tt6", [10.0, 11.0, 12.0]),  # from 10 s
    ],
)
def test_row_times_that_matlab_saved(name: str, time_s: list[float]) -> None:
    found = read_mat(MATLAB / "timetable.mat", Layout(table=name))
    np.testing.assert_allclose(found.columns["time_s"], time_s, rtol=1e-12)
    assert found.units["time_s"] == "s"


def test_units_that_matlab_saved() -> None:
    found = read_mat(MATLAB / "timetable.mat", Layout(table="tt9"))
    assert found.units == {"time_s": "s", "data1": "m/s"}
    assert list(found.columns["data1"]) == [1.0, 2.0, 3.0]


def test_dates_and_durations_are_no_common_clock() -> None:
    with pytest.raises(UserError, match=r"some have row times that are dates.*--table tt1"):
        read_mat(MATLAB / "timetable.mat")
    with pytest.raises(UserError, match=r"no variable 'TT'; it has tt1,"):
        read_mat(MATLAB / "timetable.mat", Layout(table="TT"))


@pytest.mark.parametrize("version", VERSIONS)
def test_properties_of_an_object_are_columns(tmp_path: Path, version: str) -> None:
    from matio.utils.matclass import MatlabOpaque

    columns = {name: values[:, None] for name, values in COLUMNS.items()}
    save(tmp_path / "r.mat", version, trial=MatlabOpaque(columns, "Trial"))
    found = read_mat(tmp_path / "r.mat")
    assert list(found.columns["trial.torque"]) == [0.5, 1.0, 1.5]


@pytest.mark.parametrize("version", VERSIONS)
def test_rows_that_are_stated_take_no_memory(tmp_path: Path, version: str) -> None:
    even = timetable(COLUMNS, UNITS, 1000.0)
    even.properties["any"][0, 0]["numRows"] = np.array([[1e10]])  # type: ignore[attr-defined]
    save(tmp_path / "r.mat", version, TT=even)
    with pytest.raises(UserError, match="TT expands to 298 GiB"):
        read_mat(tmp_path / "r.mat")


def test_values_that_lie_elsewhere_than_the_header_says(tmp_path: Path) -> None:
    data = bytearray((MATLAB / "table.mat").read_bytes())
    data[116] ^= 8
    (tmp_path / "r.mat").write_bytes(data)
    with pytest.raises(ValueError, match="where its header says"):
        read_mat(tmp_path / "r.mat")


def test_without_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of objects alone is refused with two ways on; of another the rest is read."""
    save(tmp_path / "r.mat", T=table(COLUMNS, UNITS), more=np.arange(3.0))
    monkeypatch.setitem(sys.modules, "matio", None)
    with pytest.raises(UserError, match=r"'rigidimeter\[matlab\]'.*table2struct\(T1, 'ToScalar"):
        read_mat(MATLAB / "table.mat")
    found = read_mat(tmp_path / "r.mat")
    assert list(found.columns) == ["more"]
    assert "'rigidimeter[matlab]'" in found.others["T"]
    with pytest.raises(UserError, match=r"no column torque_nm.*T is no column but an object that"):
        channels_of_table(found, ReadOptions())


@pytest.mark.parametrize("error", [MemoryError, TypeError])
def test_columns_beside_an_object_that_fails(tmp_path: Path, monkeypatch, error: type) -> None:
    """They are read and the reason is kept; but the lack of memory is no fault of the object."""
    save(tmp_path / "r.mat", T=table(COLUMNS, UNITS), more=np.arange(3.0))

    def fails(*_: object) -> None:
        raise error("of its own")

    monkeypatch.setattr(mat_file, "table_with_objects", fails)
    if error is MemoryError:
        with pytest.raises(MemoryError):
            read_mat(tmp_path / "r.mat")
    else:
        assert read_mat(tmp_path / "r.mat").others == {
            "T": "an object that is not read (of its own)"
        }
