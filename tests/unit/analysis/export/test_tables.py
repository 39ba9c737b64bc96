"""Folders of CSV and Parquet tables, and MATLAB files: values as recorded, to the last bit."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
import scipy.io

from rigidimeter.analysis.export import ExportedSession, export_sessions


@pytest.mark.parametrize("to", ["csv", "parquet"])
def test_tables_hold_every_number(exported: ExportedSession, tmp_path: Path, to: str) -> None:
    export_sessions([exported], to, tmp_path / "out")
    for stream in exported.streams:
        path = tmp_path / "out" / f"{stream.name}.{to}"
        reader = pyarrow.csv.read_csv if to == "csv" else pyarrow.parquet.read_table
        table = reader(path)
        for name, values in {"time_s": stream.time_s, **stream.columns}.items():
            # A column without any number says nothing of its type.
            found = table[name].cast("float64").to_numpy()
            np.testing.assert_array_equal(found, values.astype(float))
    assert json.loads((tmp_path / "out" / "session.json").read_text()) == exported.about


def test_parquet_names_units(exported: ExportedSession, tmp_path: Path) -> None:
    export_sessions([exported], "parquet", tmp_path / "out")
    schema = pyarrow.parquet.read_schema(tmp_path / "out" / "torque.parquet")
    assert schema.field("torque_nm").metadata[b"unit"].decode() == "N·m"
    assert schema.field("time_s").metadata[b"unit"] == b"s"


def test_estimates_are_a_table(exported: ExportedSession, tmp_path: Path) -> None:
    export_sessions([exported], "csv", tmp_path / "out")
    with (tmp_path / "out" / "estimates.csv").open() as file:
        rows = list(csv.DictReader(file))
    fits = exported.about["estimates"]["epochs"]
    held = exported.about["estimates"]["fixed_inertia"]["epochs"]
    for row, fit, fixed in zip(rows, fits, held, strict=True):
        for ending in ("", "_se", "_low", "_high"):
            name = f"damping_nm_s_rad{ending}"
            assert float(row[name]) == fit[name]
            assert float(row[f"fixed_inertia_{name}"]) == fixed[name]
    assert "fixed_inertia_inertia_kg_m2_se" not in rows[0]


def test_matlab_structures(exported: ExportedSession, tmp_path: Path) -> None:
    path = tmp_path / "session.mat"
    export_sessions([exported], "mat", path)
    loaded = scipy.io.loadmat(path, simplify_cells=True)
    for stream in exported.streams:
        for name, values in {"time_s": stream.time_s, **stream.columns}.items():
            np.testing.assert_array_equal(loaded[stream.name][name], values)
    assert json.loads(loaded["document"]) == exported.about
    assert loaded["session"]["virtual"]
    assert loaded["epochs"]["task"].tolist() == ["prbs", "prbs"]
    fits = exported.about["estimates"]["epochs"]
    found = loaded["estimates"]["stiffness_nm_rad_high"].tolist()
    assert found == [fit["stiffness_nm_rad_high"] for fit in fits]
