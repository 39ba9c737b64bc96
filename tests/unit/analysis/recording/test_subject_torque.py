"""M_sub of each epoch: a push that the motion does not follow is what is left of the torque."""

import numpy as np
import pyarrow.csv
import pyarrow.parquet
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading import read
from rigidimeter.analysis.recording import estimate, subject_torque, write_subject_torque
from rigidimeter.core.errors import UserError

RATE_HZ = 200.0
TIME_S = np.arange(8000) / RATE_HZ


def push_nm(time_s):
    """Return an M_sub that lies between two lines of the motion."""
    return 0.05 * np.sin(2 * np.pi * 1.725 * time_s)


@pytest.fixture(scope="module")
def pushed(tmp_path_factory):
    path = tmp_path_factory.mktemp("push") / "=push.csv"
    columns = (TIME_S, torque_nm(TIME_S) - push_nm(TIME_S), angle_rad(TIME_S))
    rows = np.column_stack(columns)
    np.savetxt(path, rows, "%.17g", ",", header="time_s,torque_nm,angle_rad", comments="")
    recording = read(path, epoch_length_s=20)
    return recording, estimate(recording)


def test_what_the_subject_pushed_is_found(pushed):
    tables = list(subject_torque(*pushed))
    assert [table["epoch"][0].as_py() for table in tables] == ["1", "2"]
    for table in tables:
        values = {name: table[name].to_numpy() for name in table.column_names[3:]}
        there = push_nm(values["time_s"])
        rest = values["subject_torque_nm"] - there
        assert np.std(rest) < 0.15 * np.std(there)  # the noise is 6 %, J, B and K 9 %
        np.testing.assert_array_equal(
            values["joint_torque_nm"] - values["torque_nm"], values["subject_torque_nm"]
        )


@pytest.mark.parametrize(
    ("suffix", "reader"),
    [(".csv", pyarrow.csv.read_csv), (".parquet", pyarrow.parquet.read_table)],
)
def test_all_epochs_in_one_file_without_formulas(pushed, tmp_path, suffix, reader):
    out = tmp_path / f"torque{suffix}"
    write_subject_torque(out, *pushed)
    read_back = reader(out)
    assert read_back.num_rows == sum(table.num_rows for table in subject_torque(*pushed))
    beside = {"torque.data-dictionary.csv"} if suffix == ".csv" else set()
    assert {path.name for path in tmp_path.iterdir()} == {out.name} | beside
    assert not read_back["source"][0].as_py().startswith("=")


def test_a_name_that_says_no_format_is_refused(pushed, tmp_path):
    with pytest.raises(UserError, match=r"must end in \.csv or \.parquet"):
        write_subject_torque(tmp_path / "torque.txt", *pushed)


def test_such_a_name_is_refused_before_anything_is_read(rigidimeter, tmp_path):
    ran = rigidimeter("estimate", tmp_path / "no_such.csv", "--subject-torque", tmp_path / "t.txt")
    assert ran.status == 1
    assert "must end in .csv or .parquet" in ran.out + ran.err
    assert "no_such" not in ran.out + ran.err
