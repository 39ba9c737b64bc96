"""Angles that begin anew after a turn, lever arms that a file states, and texts among numbers."""

import numpy as np
import pytest
from tests.dialects import ANGLE_DEG, TIME_S, TORQUE_NM, csv

from rigidimeter.analysis.reading.channels.lever_arm import lever_arm
from rigidimeter.analysis.reading.channels.wrapping import unwrapped
from rigidimeter.analysis.reading.formats import ReadOptions, read_recording
from rigidimeter.core.errors import UserError

TURN = 2 * np.pi


def test_samples_that_are_missing_stay_missing():
    angle = np.repeat(np.radians(np.arange(340.0, 400.0)), 2)
    wrapped = angle % TURN
    wrapped[1::2] = np.nan
    found, count = unwrapped(wrapped)
    assert count == 1
    np.testing.assert_allclose(found[::2] - found[0], angle[::2] - angle[0])
    assert np.all(np.isnan(found[1::2]))


@pytest.mark.parametrize(
    "angle",
    [
        np.radians(np.where(np.arange(400) % 40, 350.0, 0.0)),
        np.where(np.arange(400) % 40, 350.0, 0.0),
        np.random.default_rng(1).uniform(-np.pi, np.pi, 400),
        0.1 * np.sin(np.arange(400.0)),
        np.full(400, np.nan),
    ],
    ids=["a sensor that drops to 0", "more than a turn", "noise", "no turn", "nothing"],
)
def test_other_angles_stay_as_they_are(angle):
    found, count = unwrapped(angle)
    assert count == 0
    assert found is angle


@pytest.mark.parametrize(
    ("stated", "arm"),
    [
        ({"calibration": "Lever arm: 0.25 m"}, "0.25 m"),
        ({"calibration": "Subject; 3; Hebelarm [cm]; 25,5"}, "25.5 cm"),
        ({"calibration": "bras de levier = 250 mm"}, "250 mm"),
        ({"S01.lever_arm_m": 0.25}, "0.25 m"),
        ({"calibration": "moment arm (m) 0.25 m"}, "0.25 m"),
        ({"calibration": "Lever arm: 0.25"}, ""),
        ({"calibration": "Lever arm (cm): 0.25 m"}, ""),
        ({"calibration": "lever arm 0.2 m; lever arm 0.3 m"}, ""),
        ({"calibration": "Lever arm: 3 marks"}, ""),
        ({"calibration": "clever arm: 0.25 m"}, ""),
        ({"calibration": "Lever arm: see page 3 m"}, ""),
    ],
)
def test_lever_arms(stated, arm):
    assert lever_arm(stated) == arm


def test_a_force_is_refused_with_the_lever_arm_of_the_file(tmp_path):
    path = tmp_path / "r.csv"
    path.write_bytes(b"# Lever arm: 0.2 m\n" + csv("t (s),F (N),phi (deg)", *[np.arange(50.0)] * 3))
    with pytest.raises(UserError, match=r"--scale 'torque=0.2 m' \(as the file states\)"):
        read_recording(path, ReadOptions())


def test_texts_among_numbers_are_one_message_a_column(tmp_path):
    lines = csv("t [s],M [Nm],phi [deg]", TIME_S, TORQUE_NM, ANGLE_DEG).decode().split("\n")
    for line in range(5, 3000, 150):
        time, _, angle = lines[line].split(",")
        lines[line] = f"{time},OVR,{angle}"
    path = tmp_path / "r.csv"
    path.write_text("\n".join(lines))
    _, notices = read_recording(path, ReadOptions())
    told = [notice.text for notice in notices if "OVR" in notice.text]
    assert told == [
        f"{path}, line 6: torque_nm (column 'M [Nm]') holds 'OVR', which is not a number, nor are "
        "19 other entries of the column; they were left out"
    ]
