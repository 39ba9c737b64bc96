"""A motion is taken for degrees where torque and velocity would be too much power."""

import numpy as np
import pytest

from rigidimeter.recording.formats.gaps import Signal
from rigidimeter.recording.formats.plausible_units import about_units

TIME_S = np.arange(2000) / 200.0


def signals(**values):
    rows = np.arange(TIME_S.size)
    return {
        name: Signal(name, rows, TIME_S, np.asarray(column), rows[:0], 0.005, own_rows=False)
        for name, column in values.items()
    }


@pytest.mark.parametrize(
    ("angle", "torque_nm", "told"),
    [
        (20.0 * np.sin(2 * np.pi * TIME_S), 1.0, True),
        (np.radians(20.0) * np.sin(2 * np.pi * TIME_S), 1.0, False),
        (10.0 * TIME_S, 0.5, False),
    ],
    ids=["a limb in degrees", "a limb in rad", "an axis that turns, 5 W"],
)
def test_degrees_are_told_where_the_torque_agrees(angle, torque_nm, told):
    found = about_units(
        "file", signals(angle_rad=angle, torque_nm=torque_nm * np.ones(2000)), 0.005
    )
    assert ["looks like degrees" in notice.text for notice in found] == [True] * told


def test_without_a_torque_the_angle_alone_decides():
    (notice,) = about_units("file", signals(angle_rad=10.0 * TIME_S), 0.005)
    assert "angle_rad reaches 99.95, which looks like degrees" in notice.text
