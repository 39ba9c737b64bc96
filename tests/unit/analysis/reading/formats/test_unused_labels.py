"""A column of a few labels that nothing uses is named, with the option that uses it."""

from __future__ import annotations

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table

TIME_S = np.arange(4000) / 200
HALVES = np.repeat([0.0, 1.0], 2000)


def notices(name: str, labels: np.ndarray, **more: np.ndarray) -> list[str]:
    columns = {
        "time_s": TIME_S,
        "torque_nm": torque_nm(TIME_S),
        "angle_rad": angle_rad(TIME_S),
        name: labels,
        **more,
    }
    _, found = epochs_from_table(Table("r.csv", columns), ReadOptions())
    return [notice.text for notice in found]


@pytest.mark.parametrize("name", ["DBS", "stim", "marker", "state", "valid", "phase", "set"])
def test_labels_that_nothing_uses_are_named(name):
    (text,) = notices(name, HALVES)
    assert f"column {name!r} (0, 1) is not used" in text
    assert f"--column epoch={name}" in text
    assert f"--column condition={name}" in text


def test_beside_an_epoch_column_they_may_be_conditions():
    (text,) = notices("DBS", HALVES, epoch=HALVES + 1)
    assert "--column epoch" not in text
    assert "--column condition=DBS" in text


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("DBS", np.zeros(4000)),
        ("temperature", np.repeat([23.1, 23.2], 2000)),
        ("trigger", np.where(np.arange(4000) % 50 < 3, 1.0, 0.0)),
        ("load (N)", HALVES),
        ("counter", np.arange(4000.0)),
    ],
)
def test_what_a_sensor_gives_is_no_label(name, values):
    assert notices(name, values) == []
