"""Muscle activity is a column like the others, in volts, that an estimate can do without."""

import numpy as np
import pytest
import scipy.io

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.readers import read_recording
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table

N = 400


@pytest.fixture
def columns():
    rng = np.random.default_rng(3)
    return {
        "time_s": np.arange(N) / 100,
        "torque_nm": rng.normal(size=N),
        "angle_rad": rng.normal(size=N),
        "emg_v": 1e-5 * rng.normal(size=N),
    }


def write_csv(path, columns):
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


WRITERS = {
    "r.csv": write_csv,
    "r.npz": lambda path, columns: np.savez(path, **columns),
    "r.mat": lambda path, columns: scipy.io.savemat(path, columns),
}


@pytest.mark.parametrize("file", WRITERS)
def test_every_format_gives_the_muscle_activity_to_the_bit(tmp_path, columns, file):
    WRITERS[file](tmp_path / file, columns)
    (epoch,), notices = read_recording(tmp_path / file, ReadOptions())
    assert notices == []
    emg = epoch.channels["emg_v"]
    assert emg.unit == "V"
    np.testing.assert_array_equal(emg.values, columns["emg_v"])
    np.testing.assert_array_equal(emg.time_s, columns["time_s"])


def test_the_reaction_turns_the_torque_alone(columns):
    table = Table("t", columns)
    (plain,), _ = epochs_from_table(table, ReadOptions())
    (turned,), _ = epochs_from_table(table, ReadOptions(reaction=True))
    np.testing.assert_array_equal(turned.channels["emg_v"].values, plain.channels["emg_v"].values)
    np.testing.assert_array_equal(
        turned.channels["torque_nm"].values, -plain.channels["torque_nm"].values
    )


def test_a_column_of_another_name(columns):
    columns["biceps"] = columns.pop("emg_v")
    options = ReadOptions(columns={"emg_v": "biceps"})
    (epoch,), _ = epochs_from_table(Table("t", columns), options)
    assert "emg_v" in epoch.channels


def test_microvolts_are_told(columns):
    columns["emg_v"] = 1e6 * columns["emg_v"]
    _, notices = epochs_from_table(Table("t", columns), ReadOptions())
    assert len(notices) == 1
    assert notices[0].level == "warning"
    assert "looks like microvolts: say --unit emg=uV" in notices[0].text
