"""Corners against closed forms."""

import math

import numpy as np
import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.model import JointDynamics
from rigidimeter.planning import APPENDIX_A, Forearm, corners, design


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


def test_a_forearm_of_another_size() -> None:
    """1.5 % of 80 kg as a rod of 0.3 m: 1.2 · 0.09 / 3 = 0.036 kg·m², and robot and controller."""
    arm = Forearm(80.0, 0.3).arm()
    assert arm.inertia_kg_m2 == pytest.approx(0.036 + 4e-3 + 8e-4)
    assert (arm.damping_nm_s_rad, arm.stiffness_nm_rad) == (0.088, 1.5)
    assert Forearm().inertia_kg_m2 == pytest.approx(8.6625e-4)  # as printed
    found = design(forearm=Forearm(80.0, 0.3))
    assert found.bandwidth == corners(arm)
    assert design().bandwidth == corners(APPENDIX_A)


@pytest.mark.parametrize(
    ("forearm", "message"),
    [
        (Forearm(0.0), "a body mass of 0 kg is not possible; it must be above 0 and at most 500"),
        (Forearm(length_m=26.0), "a forearm of 26 m is not possible; it must be .* at most 1 m"),
        (Forearm(length_m=math.nan), "a forearm of nan m"),
    ],
)
def test_a_forearm_that_is_none_is_refused(forearm: Forearm, message: str) -> None:
    with pytest.raises(UserError, match=message):
        design(forearm=forearm)
