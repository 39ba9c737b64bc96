"""Rates, types and labels of binary files, and what MATLAB 7.3 needs."""

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.readers import read_recording, read_table
from rigidimeter.core.errors import UserError


@pytest.fixture
def columns():
    rng = np.random.default_rng(3)
    time_s = np.arange(400) / 100 + rng.uniform(-1e-4, 1e-4, 400)
    return {"time_s": time_s, "torque_nm": rng.normal(size=400), "angle_rad": rng.normal(size=400)}


def write_mat73(path: Path, columns) -> Path:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            dataset = file.create_dataset(name, data=np.asarray(values)[None, :])
            dataset.attrs["MATLAB_class"] = np.bytes_("double")
    return path


def write_npz(path: Path, columns) -> Path:
    np.savez(path, **columns)
    return path


@pytest.mark.parametrize("name", ["rate_hz", "fs_hz", "fs", "sampling_rate_hz"])
def test_the_files_own_rate(tmp_path, columns, name):
    del columns["time_s"]
    path = write_npz(tmp_path / "r.npz", columns | {name: 250.0})
    (epoch,), _ = read_recording(path, ReadOptions())
    np.testing.assert_array_equal(epoch.channels["torque_nm"].time_s, np.arange(400) / 250)


def test_a_rate_that_agrees_leaves_the_time_column_in_charge(tmp_path, columns):
    path = write_npz(tmp_path / "r.npz", columns)
    (epoch,), _ = read_recording(path, ReadOptions(rate_hz=100.5))
    np.testing.assert_array_equal(epoch.channels["torque_nm"].time_s, columns["time_s"])


def test_stamps_rounded_to_milliseconds_agree_with_300_hz(tmp_path, columns):
    columns = {name: np.resize(values, 4096) for name, values in columns.items()}
    columns["time_s"] = np.round(np.arange(4096) / 300, 3)
    columns["angle_rad"] /= 100
    epochs, _ = read_recording(write_npz(tmp_path / "r.npz", columns), ReadOptions(rate_hz=300))
    assert len(epochs) == 1


def test_integers_and_float32_become_float64(tmp_path):
    values = np.arange(50)
    path = write_npz(
        tmp_path / "r.npz",
        {"time_s": values, "torque_nm": values.astype(np.int16), "angle_rad": np.zeros(50, "f4")},
    )
    (epoch,), _ = read_recording(path, ReadOptions())
    assert {channel.values.dtype for channel in epoch.channels.values()} == {np.dtype("f8")}


def test_matlab_cells_of_text_are_labels(tmp_path, columns):
    cells = np.empty((400, 1), dtype=object)
    cells[:200], cells[200:] = "first", "second"
    path = tmp_path / "r.mat"
    scipy.io.savemat(path, columns | {"epoch": cells})
    epochs, _ = read_recording(path, ReadOptions())
    assert [epoch.label for epoch in epochs] == ["first", "second"]


def test_matlab_73_text_cells_and_structures(tmp_path, columns):
    path = write_mat73(tmp_path / "r.mat", {"time_s": columns["time_s"]})
    with h5py.File(path, "r+") as file:
        for name in ("torque_nm", "angle_rad"):
            file.create_dataset(f"data/{name}", data=columns[name][:, None])
        texts = []
        for key, text in {"a": "OFF", "b": "DBS"}.items():
            dataset = file.create_dataset(f"#refs#/{key}", data=np.array([[ord(c)] for c in text]))
            dataset.attrs["MATLAB_class"] = np.bytes_("char")
            texts.append(dataset.ref)
        cells = np.array([texts[k // 200] for k in range(400)], dtype=h5py.ref_dtype)[None, :]
        cell = file.create_dataset("epoch", data=cells, dtype=h5py.ref_dtype)
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        task = file.create_dataset("task", data=np.array([[ord(c)] for c in "sinusoid"]))
        task.attrs["MATLAB_class"] = np.bytes_("char")
    options = ReadOptions(columns={n: f"data.{n}" for n in ("torque_nm", "angle_rad")})
    epochs, _ = read_recording(path, options)
    assert [(epoch.label, epoch.task) for epoch in epochs] == [
        ("OFF", "sinusoid"), ("DBS", "sinusoid"),
    ]  # fmt: skip
    np.testing.assert_array_equal(
        epochs[1].channels["torque_nm"].values, columns["torque_nm"][200:]
    )


def test_matlab_73_without_h5py_says_what_to_install(tmp_path, columns, monkeypatch):
    path = write_mat73(tmp_path / "r.mat", columns)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(UserError, match=r"pip install 'rigidimeter\[matlab\]'"):
        read_table(path)


def test_numpy_text_is_a_label(tmp_path, columns):
    labels = np.where(np.arange(400) < 100, "", "run 7")
    path = write_npz(tmp_path / "r.npz", columns | {"epoch": labels, "condition": "ON"})
    (epoch,), _ = read_recording(path, ReadOptions(condition="unused"))
    assert (epoch.label, epoch.condition, len(epoch.channels["torque_nm"])) == ("run 7", "ON", 300)


def test_entries_of_other_lengths_that_are_not_read_do_no_harm(tmp_path, columns):
    extra = {"spectrum": np.zeros(7), "map": np.zeros((3, 4)), "z": np.array([1j, 2j])}
    path = write_npz(tmp_path / "r.npz", columns | extra)
    assert len(read_recording(path, ReadOptions())[0]) == 1
