"""Corners against closed forms."""

import math

import numpy as np
import pytest

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.experiment import APPENDIX_A, corners


def test_a_corner_of_a_critically_damped_joint() -> None:
    # J = B/2 = K = 1: |1 + jω|² = √2, so ω² = √2 − 1
    table = corners(JointDynamics(1.0, 2.0, 1.0), 0.0)
    expected = math.sqrt(math.sqrt(2.0) - 1.0) / (2 * math.pi)
    assert table.nominal.bandwidth_hz == pytest.approx(expected)
    assert [corner.bandwidth_hz for corner in table.corners] == pytest.approx([expected] * 8)


def test_eight_corners_take_every_sign_once() -> None:
    table = corners(JointDynamics(1.0, 2.0, 4.0), 25.0)
    assert len({corner.signs for corner in table.corners}) == 8
    for corner in table.corners:
        expected = np.array([1.0, 2.0, 4.0]) * (1 + 0.25 * np.array(corner.signs))
        assert list(vars(corner.joint).values()) == expected.tolist()
        assert corner.bandwidth_hz == corner.joint.bandwidth_hz()
    assert table.corners[0].signs == (-1, -1, -1)
    assert table.corners[-1].signs == (1, 1, 1)
    assert table.nominal.signs == (0, 0, 0)


def test_extremes_are_the_extremes() -> None:
    table = corners()
    all_hz = [corner.bandwidth_hz for corner in table.corners]
    assert table.widest.bandwidth_hz == max(all_hz)
    assert table.widest.signs == (-1, -1, 1)
    narrowest = min(table.corners, key=lambda corner: corner.bandwidth_hz)
    assert narrowest.signs == (-1, 1, -1)


@pytest.mark.parametrize("uncertainty", [-1.0, 100.0, float("nan")])
def test_an_uncertainty_out_of_range_is_refused(uncertainty: float) -> None:
    with pytest.raises(ValueError, match="uncertainty"):
        corners(APPENDIX_A, uncertainty)


def test_a_joint_without_stiffness_has_no_bandwidth() -> None:
    with pytest.raises(ValueError, match="stiffness"):
        corners(JointDynamics(1.0, 1.0, 0.0))
