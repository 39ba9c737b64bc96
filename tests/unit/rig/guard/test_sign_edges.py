"""The test of the torque's sign at its edges: small squares, rounding, and what ends a look."""

import numpy as np
import pytest
from tests.unit.rig.guard.test_torque_sign import JOINT, LEFT, ROWS, window

from rigidimeter.rig.guard import (
    ACCELERATION,
    INSTRUMENTS,
    JERK,
    SINGULAR,
    explained_answer,
    left_by_each_sign,
    sign_is_wrong,
    solved,
    solved_for,
    torque_sign,
    whitened,
    without,
)

A_WRONG = (1e-3, np.diag([0.0, 1.0, 1.0, 1.0, 1.0]), np.zeros(INSTRUMENTS))
A_WRONG[1][1, 4] = A_WRONG[1][4, 1] = -1.0


def squares(**products):
    """Return squares and products of (j, a, v, q, M): 1 and 0, but for those given."""
    g = np.eye(5)
    for names, value in products.items():
        i, k = ("javqm".index(name) for name in names)
        g[i, k] = g[k, i] = value
    return g


# --- what is small


def test_small_columns_are_made_white_as_large_ones_are():
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((ROWS, INSTRUMENTS + 5))
    weights = rng.standard_normal(INSTRUMENTS)
    large, small = (whitened(size * columns, weights, 2) for size in (1.0, 1e-3))
    np.testing.assert_allclose(small, 1e-3 * large, rtol=1e-9, atol=1e-12)


def test_what_is_added_to_a_square_is_positive_and_small():
    assert SINGULAR == 1e-9
    np.testing.assert_allclose(solved_for(np.zeros((2, 2)), np.array([1e-9, 2e-9])), [1.0, 2.0])


@pytest.mark.parametrize("column", [JERK, ACCELERATION])
def test_a_column_as_small_as_that_explains_half(column):
    name = "ja"[column]
    g = squares(**{name * 2: SINGULAR, name + "m": 1e-5})
    assert without(g, column)[4, 4] == pytest.approx(1.0 - 0.5 * 1e-10 / SINGULAR)


@pytest.mark.parametrize("name", ["a", "v", "q"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_each_coefficient_has_a_sign_however_small_it_is(name, sign):
    """M·x = ± 10⁻⁵ with x² = 10⁻⁹ leaves 1 − 10⁻¹⁰/(2·10⁻⁹) of M² = 1; with x² = 1, 1 − m²."""
    left = left_by_each_sign(squares(**{name * 2: SINGULAR, name + "m": sign * 1e-5}))
    assert left[:: int(sign)] == pytest.approx((0.95, 1.0))
    left = left_by_each_sign(squares(**{name + "m": sign * 5e-4}))
    assert left[:: int(sign)] == pytest.approx((1.0 - 2.5e-7, 1.0), rel=1e-10)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rounding_leaves_no_less_than_nothing(sign):
    left = left_by_each_sign(squares(am=sign * 1.000001))
    assert left[:: int(sign)] == (0.0, 1.0)


def test_a_small_determinant_has_a_solution():
    rng = np.random.default_rng(5)
    matrix, right = 0.01 * rng.standard_normal((3, 3)), rng.standard_normal(3)
    assert abs(np.linalg.det(matrix)) < 1e-5
    np.testing.assert_allclose(solved(*matrix.ravel(), *right), np.linalg.solve(matrix, right))


# --- what ends a look


@pytest.mark.parametrize(
    ("braked", "accelerated", "wrong"),
    [
        *((5e-4, 5e-4, False), (-5e-4, 5e-4, True), (5e-4, -5e-4, True)),
        *((0.0, 0.5, True), (0.5, 0.0, True), (0.5, 0.5, False)),
    ],
)
def test_a_torque_that_accelerates_and_brakes_the_joint_has_the_right_sign(
    monkeypatch, braked, accelerated, wrong
):
    """M v > 0 and M a > 0 in the mean, whatever the perturbation seems to cause."""
    columns = np.zeros((3, INSTRUMENTS + 5))
    columns[:, -1] = (2.0, 0.0, 0.0)
    columns[0, INSTRUMENTS + 1 : INSTRUMENTS + 3] = 0.5 * accelerated, 0.5 * braked
    columns[1:, INSTRUMENTS + 1 : INSTRUMENTS + 3] = -1.0  # M is 0 there
    monkeypatch.setattr(torque_sign, "difference_columns", lambda _: columns)
    monkeypatch.setattr(torque_sign, "explained_answer", lambda _: A_WRONG)
    assert sign_is_wrong(window(JOINT), True, LEFT) == wrong


def test_what_may_be_a_torque_that_is_early_is_no_wrong_sign():
    """J a(t + τ) = J a + J τ j, and in a narrow band j = −ω² v: a damping below zero."""
    early = window(np.zeros(4), 0.01)
    j, v = 2, 4
    early[:, j] = -early[:, v] + 0.1 * np.random.default_rng(9).standard_normal(len(early))
    early[:, -1] += early[:, j]
    assert sign_is_wrong(early, True, LEFT._replace(if_early=1.1))
    assert not sign_is_wrong(early, True, LEFT)
    noise, answer, _ = explained_answer(
        whitened(torque_sign.difference_columns(early), np.zeros(INSTRUMENTS), 1)
    )
    assert without(answer, JERK)[4, 4] < noise  # j leaves nothing of it
