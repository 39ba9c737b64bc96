"""Muscle activity that is in microvolts."""

import numpy as np
import pytest

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
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


def test_microvolts_are_told(columns):
    columns["emg_v"] = 1e6 * columns["emg_v"]
    _, notices = epochs_from_table(Table("t", columns), ReadOptions())
    assert len(notices) == 1
    assert notices[0].level == "warning"
    assert "looks like microvolts: say --unit emg=uV" in notices[0].text
