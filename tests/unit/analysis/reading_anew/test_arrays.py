"""Columns of anything: matrices, records, structures and timetables, in every format of arrays."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
from tests.archive_files import write_mat73
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading_anew import Mapping, columns_of, mapping_of, read_file
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import noted_digests

T = np.arange(3000) / 200.0
M, A = torque_nm(T, 1), angle_rad(T, 1)
Q = np.column_stack([M, 0 * T, A])


def npz(path: Path, **arrays: np.ndarray) -> None:
    np.savez(path, **arrays)


def mat(path: Path, **arrays: np.ndarray) -> None:
    scipy.io.savemat(path, arrays)


def mat73(path: Path, **arrays: np.ndarray) -> None:
    write_mat73(path, arrays)


def hdf5(path: Path, **arrays: np.ndarray) -> None:
    with h5py.File(path, "w") as file:
        for name, array in arrays.items():
            file[name] = array


WRITERS: dict[str, Callable[..., None]] = {
    "r.npz": npz,
    "r.mat": mat,
    "r.h5": hdf5,
}


def series(file: h5py.File, name: str, data: np.ndarray, unit: str) -> None:
    group = file.create_group(f"acquisition/{name}")
    group.attrs["neurodata_type"] = "TimeSeries"
    group["data"] = data
    group["data"].attrs["unit"] = unit
    group["starting_time"] = 0.0
    group["starting_time"].attrs["rate"] = 200.0


@pytest.mark.parametrize("file", WRITERS)
@pytest.mark.parametrize("turned", [False, True])
def test_a_matrix_has_columns(tmp_path: Path, file: str, turned: bool) -> None:
    WRITERS[file](tmp_path / file, t=T, q=Q.T if turned else Q)
    with pytest.raises(UserError, match="no name of them is known"):
        read_file(tmp_path / file)
    said = mapping_of(
        column={"time": "t", "torque": "q[0]", "angle": "q[2]"},
        unit={"time": "s", "torque": "Nm", "angle": "rad"},
    )
    found = read_file(tmp_path / file, said).epochs[0].channels
    assert np.array_equal(found["torque_nm"].values, M)
    assert np.array_equal(found["angle_rad"].values, A)


def test_a_series_of_several_values_has_columns(tmp_path: Path) -> None:
    path = tmp_path / "r.nwb"
    with h5py.File(path, "w") as file:
        file.attrs["nwb_version"] = "2.7"
        series(file, "joint", Q, "Nm")
        series(file, "angle", A, "rad")
    found = read_file(path, mapping_of(column={"torque": "joint[0]"}))
    assert np.array_equal(found.epochs[0].channels["torque_nm"].values, M)


@pytest.mark.parametrize("file", ["r.npz", "r.h5"])
def test_fields_of_records_are_columns(tmp_path: Path, file: str) -> None:
    kinds = [("time_s", "f8"), ("torque_nm", "f4"), ("angle_rad", "f8")]
    table = np.zeros(T.size, dtype=kinds)
    table["time_s"], table["torque_nm"], table["angle_rad"] = T, M, A
    WRITERS[file](tmp_path / file, trial=table)
    found = read_file(tmp_path / file, by_numbers=True).epochs[0].channels
    assert np.array_equal(found["angle_rad"].values, A)


def test_datasets_state_their_unit_and_rate(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    with h5py.File(path, "w") as file:
        file.attrs["fs"] = 200.0
        for name, unit, data in (("torque", "mNm", 1e3 * M), ("angle", "deg", np.degrees(A))):
            file[f"arm/{name}"] = data
            file[f"arm/{name}"].attrs["unit"] = unit
    found = read_file(path).epochs[0].channels
    assert np.allclose(found["angle_rad"].values, A)
    assert np.allclose(found["torque_nm"].values, M)
    assert found["angle_rad"].rate_hz == pytest.approx(200.0)


def test_a_factor_in_an_attribute_is_not_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    hdf5(path, time_s=T, torque_nm=M, angle_rad=A)
    with h5py.File(path, "a") as file:
        file["torque_nm"].attrs["scale_factor"] = 0.1
    with pytest.raises(UserError, match=r"scale_factor of 0\.1, which is not applied"):
        read_file(path)


@pytest.mark.parametrize("file", ["r.npz", "r.mat", "r.h5"])
def test_one_of_several_tables_is_named_by_its_names(tmp_path: Path, file: str) -> None:
    WRITERS[file](tmp_path / file, time_s=T, torque_nm=M, angle_rad=A, other=np.arange(7.0))
    assert len(read_file(tmp_path / file).epochs) == 1


@pytest.mark.parametrize("file", ["r.npz", "r.mat", "r.h5"])
def test_columns_of_different_lengths_are_refused(tmp_path: Path, file: str) -> None:
    WRITERS[file](tmp_path / file, time_s=T, torque_nm=M[:-1], angle_rad=A)
    with pytest.raises(UserError, match="all columns must have the same length"):
        read_file(tmp_path / file)


def test_a_structure_of_matlab_7_3(tmp_path: Path) -> None:
    path = tmp_path / "r.mat"
    mat73(path, t_s=T, M_Nm=M, phi_rad=A)
    assert np.array_equal(read_file(path).epochs[0].channels["angle_rad"].values, A)


def test_nothing_is_unpickled(tmp_path: Path) -> None:
    path = tmp_path / "r.npz"
    np.savez(path, time_s=T, torque_nm=M, angle_rad=A, who=np.array([{"a": 1}], dtype=object))
    with pytest.raises(UserError, match="Python objects"):
        columns_of(path, Mapping())


@pytest.mark.parametrize("file", ["r.npz", "r.mat", "r.h5", "r.parquet", "r.nwb"])
@pytest.mark.parametrize("seed", range(8))
def test_a_damaged_file_is_refused_in_a_sentence_or_read_as_it_was(
    tmp_path: Path, file: str, seed: int
) -> None:
    path, rng = tmp_path / file, np.random.default_rng(seed)
    if file == "r.parquet":
        import pandas as pd

        pd.DataFrame({"time_s": T, "torque_nm": M, "angle_rad": A}).to_parquet(path)
    elif file == "r.nwb":
        with h5py.File(path, "w") as opened:
            series(opened, "torque", M, "Nm")
            series(opened, "angle", A, "rad")
    else:
        WRITERS[file](path, time_s=T, torque_nm=M, angle_rad=A)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(rng.integers(1, len(whole) - 1))])
    with pytest.raises(UserError, match=re.escape(file)):
        read_file(path)


@pytest.mark.parametrize("file", ["r.npz", "r.mat", "r.h5", "r.csv"])
def test_a_file_is_hashed_once(tmp_path: Path, file: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path, made = tmp_path / file, []
    if file == "r.csv":
        rows = np.column_stack([T, M, A])
        np.savetxt(path, rows, delimiter=",", header="time_s,torque_nm,angle_rad", comments="")
    else:
        WRITERS[file](path, time_s=T, torque_nm=M, angle_rad=A)
    digest = hashlib.file_digest

    def counted(opened: object, name: str) -> object:
        made.append(name)
        return digest(opened, name)

    monkeypatch.setattr(hashlib, "file_digest", counted)
    with noted_digests() as digests:
        read_file(path)
    assert digests == {path: hashlib.sha256(path.read_bytes()).hexdigest()}
    assert made == ["sha256"]
