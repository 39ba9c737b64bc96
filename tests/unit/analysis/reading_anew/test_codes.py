"""Samples that were lost and written as a number, in smooth, noisy and coarse columns."""

from __future__ import annotations

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading_anew import Column, Columns, Mapping, mapping_of, verdict

T = np.arange(6000) / 200.0
M, A = torque_nm(T, 1, noise_nm=0.02), angle_rad(T, 1)


def lost_of(torque: np.ndarray, said: Mapping | None = None) -> np.ndarray:
    """Return the rows of a torque that are taken for lost samples."""
    given = {"time_s": T, "torque_nm": torque, "angle_rad": A}
    file = Columns("r", {name: Column.of(values) for name, values in given.items()})
    return np.flatnonzero(np.isnan(verdict(file, said or Mapping()).found.raw["torque"]))


@pytest.mark.parametrize("step", [0.0, 1e-4, 0.005, 0.05])
@pytest.mark.parametrize("code", [0.0, -9.99, 32767.0])
@pytest.mark.parametrize("share", [0.001, 0.02, 0.1])
def test_a_code_is_found_in_every_sensor(step: float, code: float, share: float) -> None:
    torque = 1.5 + (np.round(M / step) * step if step else M)
    lost = np.random.default_rng(2).random(T.size) < share
    written = np.where(lost, code, torque)
    assert np.array_equal(lost_of(written), np.flatnonzero(written == code))


@pytest.mark.parametrize("step", [0.0, 1e-4, 0.005, 0.05])
@pytest.mark.parametrize("level", [0.0, 0.5])
def test_what_only_recurs_is_no_code(step: float, level: float) -> None:
    torque = level + (np.round(M / step) * step if step else M)
    assert lost_of(torque).size == 0


def test_two_codes_in_a_sensor_that_is_read_twice_a_sample() -> None:
    torque = np.repeat(M[::2], 2)
    rows = np.repeat(np.random.default_rng(3).random(T.size // 2), 2)
    with_codes = np.where(rows < 0.03, -9.99, np.where(rows > 0.98, 99.0, torque))
    assert np.array_equal(lost_of(with_codes), np.flatnonzero((rows < 0.03) | (rows > 0.98)))


def test_what_the_user_says_counts() -> None:
    torque = np.where(np.random.default_rng(4).random(T.size) < 0.02, 0.0, 0.5 + M)
    assert lost_of(torque).size == np.count_nonzero(torque == 0)
    assert lost_of(torque, mapping_of(missing="none")).size == 0
    assert lost_of(np.where(torque, torque, 7.0), mapping_of(missing=[0])).size == 0
