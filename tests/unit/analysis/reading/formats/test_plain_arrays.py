"""Arrays and texts out of Python: HDF5, NPZ with a matrix, text that gzip compressed."""

import gzip

import h5py
import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading.channels.channels_of_table import channels_of_table
from rigidimeter.analysis.reading.formats import read_table
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.core.errors import UserError

TIME_S = np.arange(2000) / 200.0
TORQUE_NM, ANGLE_RAD = torque_nm(TIME_S), angle_rad(TIME_S)
ANGLE_DEG = np.degrees(ANGLE_RAD)
TEXT = "time_s,torque_nm,angle_deg\n" + "".join(
    f"{t:.3f},{m:.9f},{a:.9f}\n" for t, m, a in zip(TIME_S, TORQUE_NM, ANGLE_DEG, strict=True)
)


def read_right(path):
    read = channels_of_table(read_table(path), ReadOptions())
    np.testing.assert_allclose(read.time_s, TIME_S, atol=1e-12)
    np.testing.assert_allclose(read.values["torque_nm"], TORQUE_NM, atol=1e-9)
    np.testing.assert_allclose(read.values["angle_rad"], ANGLE_RAD, atol=1e-9)


def write_hdf5(path, group="", attributes=(), **datasets):
    with h5py.File(path, "w") as file:
        place = file.require_group(group) if group else file
        place.attrs.update(dict(attributes))
        for name, (values, own) in datasets.items():
            place[name] = values
            place[name].attrs.update(own)


@pytest.mark.parametrize("group", ["", "trial1/raw"])
def test_datasets_of_hdf5_have_the_unit_and_rate_of_their_attributes(tmp_path, group):
    path = tmp_path / "r.h5"
    torque, angle = (TORQUE_NM, {"units": "Nm"}), (ANGLE_DEG, {"unit": "deg", "offset": 0})
    write_hdf5(path, group, {"fs": 200}, torque=torque, angle=angle)
    read_right(path)


def test_a_dataset_of_hdf5_with_a_scale_of_its_own_is_no_column(tmp_path):
    path = tmp_path / "r.h5"
    counts = (TORQUE_NM / 0.001, {"units": "Nm", "scale_factor": 0.001})
    write_hdf5(path, "", {"fs": 200.0}, torque=counts, angle_rad=(ANGLE_RAD, {}))
    with pytest.raises(UserError, match=r"scale_factor of 0\.001, which is not applied"):
        channels_of_table(read_table(path), ReadOptions())


def test_datasets_of_hdf5_with_different_rates_are_not_put_on_one_clock(tmp_path):
    path = tmp_path / "r.h5"
    torque = (TORQUE_NM, {"fs": 1000.0})
    write_hdf5(path, torque_nm=torque, angle_rad=(ANGLE_RAD, {"fs": 200.0}))
    with pytest.raises(UserError, match="several sampling rates"):
        channels_of_table(read_table(path), ReadOptions())


def test_hdf5_that_is_nwb_is_told_its_name(tmp_path):
    path = tmp_path / "r.h5"
    write_hdf5(path, "", {"nwb_version": "2.7.0"}, torque_nm=(TORQUE_NM, {}))
    with pytest.raises(UserError, match=r"let its name end in \.nwb"):
        read_table(path)


@pytest.mark.parametrize("turned", [False, True])
def test_a_matrix_of_npz_has_the_names_beside_it(tmp_path, turned):
    path = tmp_path / "r.npz"
    matrix = np.column_stack([TORQUE_NM, ANGLE_DEG])
    named = {"columns": ["torque", "angle"], "units": ["Nm", "deg"], "fs": 200.0}
    np.savez(path, data=matrix.T if turned else matrix, **named)
    read_right(path)


def test_text_that_gzip_compressed_is_read_as_the_text(tmp_path):
    path = tmp_path / "r.csv.gz"
    path.write_bytes(gzip.compress(TEXT.encode()))
    read_right(path)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (lambda: gzip.compress(TEXT.encode())[:2000], "is not a complete gzip file"),
        (lambda: gzip.compress(b"0" * (129 * 2**20), 1), "expands to more than 128 MiB"),
    ],
    ids=["cut", "swollen"],
)
def test_a_cut_or_swollen_gzip_file_is_refused(tmp_path, content, told):
    path = tmp_path / "r.csv.gz"
    path.write_bytes(content())
    with pytest.raises(UserError, match=told):
        read_table(path)


@pytest.mark.parametrize(
    ("suffix", "told"),
    [(".npy", "numpy.savez"), (".itx", "delimited text"), (".adicht", "export it from LabChart")],
)
def test_a_type_that_is_not_read_has_a_way_on(tmp_path, suffix, told):
    path = tmp_path / f"r{suffix}"
    path.write_bytes(b"content")
    with pytest.raises(UserError, match=told):
        read_table(path)


def test_columns_whose_names_are_not_known_are_not_guessed(tmp_path):
    path = tmp_path / "r.csv"
    names = "Время [с],Момент [Н·м],Угол [град]\n"
    path.write_text(names + TEXT.split("\n", 1)[1], encoding="utf-8")
    with pytest.raises(UserError, match="--column torque=NAME --unit torque=Nm") as refused:
        channels_of_table(read_table(path), ReadOptions())
    assert "nearest" not in str(refused.value)


def test_the_nearest_column_is_the_one_with_the_unit(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("時間[s],角度[deg],回転力[Nm]\n" + "0,1,2\n1,2,3\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"the nearest is 回転力\[Nm\]"):
        channels_of_table(read_table(path), ReadOptions())
