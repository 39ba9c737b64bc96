"""Samples that were lost and written as a number are left out; what a sensor measured is not.

Through the reader no scenario could show each kind of signal in which nothing must be found.
"""

from __future__ import annotations

import numpy as np
import pytest
from tests.known_joint import TRUTH, angle_rad, torque_nm

import rigidimeter as rm
from rigidimeter.analysis.reading.channels.missing_codes import missing_codes

TIME_S = np.arange(4000) / 200
TORQUE, ANGLE = torque_nm(TIME_S), angle_rad(TIME_S)
HEAD = "time_s,torque_nm,angle_rad"


def steps_nm(seed: int, noise_nm: float = 0.004) -> np.ndarray:
    """A torque in steps of five ticks, with the mean of both where it steps."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.uniform(0.5, 1.1, 800) * rng.choice([-1, 1], 800), 5)
    between = np.concatenate((levels[:1], 0.5 * (levels[1:] + levels[:-1])))
    return between + noise_nm * rng.standard_normal(levels.size)


def rows(seed: int, share: float) -> np.ndarray:
    return np.flatnonzero(np.random.default_rng(seed).random(TIME_S.size) < share)


@pytest.mark.parametrize("share", [0.002, 0.02, 0.1])
@pytest.mark.parametrize("values", [TORQUE, steps_nm(3), ANGLE], ids=["torque", "steps", "angle"])
@pytest.mark.parametrize("code", [0.0, -9.99, 32767.0])
def test_a_code_is_found(values, share, code):
    lost = rows(7, share)
    written = values.copy()
    written[lost] = code
    found = missing_codes(written)
    assert [one.value for one in found] == [code]
    assert set(lost) <= set(found[0].rows)
    assert found[0].rows.size == lost.size


def test_two_codes_are_found():
    written = TORQUE.copy()
    written[rows(1, 0.01)] = -999.0
    written[rows(2, 0.01)] = 0.0
    assert {one.value for one in missing_codes(written)} == {0.0, -999.0}


@pytest.mark.parametrize(
    "values",
    [
        TORQUE,
        ANGLE,
        steps_nm(1),
        steps_nm(1, 0.0),
        np.round(steps_nm(2), 3),
        np.round(TORQUE / 0.05) * 0.05,
        np.round(ANGLE / 0.002) * 0.002,
        np.gradient(np.round(ANGLE / 0.0005) * 0.0005) * 200,
        np.clip(TORQUE, -0.1, 0.1),
        np.where(np.abs(TORQUE) < 0.05, 0.0, TORQUE),
        np.sign(steps_nm(4)),
        np.round(np.random.default_rng(5).standard_normal(4000), 1),
        np.round(np.random.default_rng(5).laplace(size=4000) ** 3, 1),
        np.round(np.where(np.arange(4000) % 37 == 0, 5.0, 0.0)
                 + 0.1 * np.random.default_rng(6).standard_normal(4000), 1),
        np.repeat(TORQUE[::4], 4),
        np.zeros(4000),
        np.arange(10.0),
    ],
)  # fmt: skip
def test_what_a_sensor_measured_is_no_code(values):
    assert missing_codes(values) == []


def written(path, torque, angle):
    np.savetxt(path, np.c_[TIME_S, torque, angle], delimiter=",", header=HEAD, comments="")
    return path


@pytest.fixture
def zeros(tmp_path):
    torque = TORQUE.copy()
    torque[rows(9, 0.05)] = 0.0
    return written(tmp_path / "r.csv", torque, ANGLE)


def stiffness(recording):
    return rm.estimate(recording).table()["stiffness_nm_rad"][0]


def test_they_are_left_out_and_reported(zeros):
    recording = rm.read(zeros)
    assert any("holds 0 in" in notice.text for notice in recording.notices)
    assert stiffness(recording) == pytest.approx(TRUTH[2], rel=5e-3)


def test_the_user_may_keep_them_or_state_them(zeros):
    assert stiffness(rm.read(zeros, missing="none")) < 0.97 * TRUTH[2]
    stated = rm.read(zeros, missing=(0, -999))
    assert any("holds 0 in" in notice.text for notice in stated.notices)
    assert stiffness(stated) == pytest.approx(TRUTH[2], rel=5e-3)
    with pytest.raises(Exception, match=r"missing nought: must be numbers .* or none"):
        rm.read(zeros, missing="nought")
