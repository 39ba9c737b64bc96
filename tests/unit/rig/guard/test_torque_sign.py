"""The test of the torque's sign: its parts against least squares, its rate of false alarms."""

import itertools

import numpy as np
import pytest
import scipy

from rigidimeter.rig.guard import (
    BEFORE,
    COLUMNS,
    DIFFERENCES,
    FALSE_ALARMS,
    IF_EARLY,
    INSTRUMENTS,
    LAGS,
    PASSES,
    difference_columns,
    explained_answer,
    left_by_each_sign,
    max_left,
    sign_is_wrong,
    solved,
    solved_for,
    torque_sign,
    whitened,
    without,
)

ROWS = 48


def left_by(columns, others):
    """Return what a least-squares fit on the columns leaves of the others."""
    return others - columns @ np.linalg.lstsq(columns, others, rcond=None)[0]


# --- parts


def test_a_table_holds_third_differences_and_the_instruments_of_rows_before():
    window = np.random.default_rng(1).standard_normal((ROWS + BEFORE, COLUMNS))
    fast = np.diff(window, DIFFERENCES, axis=0)
    late = [fast[LAGS - lag : len(fast) - lag, 1] for lag in range(LAGS + 1)]
    expected = np.column_stack([fast[LAGS:, 0], *late, fast[LAGS:, 2:]])
    expected /= np.linalg.norm(expected, axis=0)
    assert expected.shape == (ROWS, INSTRUMENTS + 5)
    np.testing.assert_allclose(difference_columns(window), expected)


def test_what_is_constant_linear_or_curved_is_no_part_of_a_table():
    t = np.arange(float(ROWS + BEFORE))[:, None]
    assert np.abs(np.diff(3.0 - 2.0 * t + 0.1 * t * t, DIFFERENCES, axis=0)).max() < 1e-9
    assert not difference_columns(np.ones((ROWS + BEFORE, COLUMNS))).any()


def test_answer_and_noise_are_those_of_least_squares():
    columns = np.random.default_rng(2).standard_normal((ROWS, INSTRUMENTS + 5))
    z, x = columns[:, :INSTRUMENTS], columns[:, INSTRUMENTS:]
    apart = left_by(z, x)
    noise, answer, weights = explained_answer(columns)
    assert noise == pytest.approx(float(apart[:, -1] @ apart[:, -1]), rel=1e-6)
    np.testing.assert_allclose(answer, x.T @ x - apart.T @ apart, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(z @ weights, x[:, -1] - apart[:, -1], rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("order", [1, 2, 4])
def test_columns_are_made_white_by_the_autoregression_of_what_the_weights_leave(order):
    rng = np.random.default_rng(2)
    columns, weights = (
        rng.standard_normal((ROWS, INSTRUMENTS + 5)),
        rng.standard_normal(INSTRUMENTS),
    )
    own = columns[:, -1] - columns[:, :INSTRUMENTS] @ weights
    lags = range(1, order + 1)
    past = np.column_stack([own[order - lag : ROWS - lag] for lag in lags])
    phi = np.linalg.lstsq(past, own[order:], rcond=None)[0]
    expected = columns[order:].copy()
    for lag, of_lag in zip(lags, phi, strict=True):
        expected -= of_lag * columns[order - lag : ROWS - lag]
    np.testing.assert_allclose(whitened(columns, weights, order), expected, rtol=1e-6, atol=1e-6)


def test_columns_of_no_noise_stay_as_they_are():
    columns = np.random.default_rng(2).standard_normal((ROWS, INSTRUMENTS + 5))
    columns[:, -1] = 0.0
    np.testing.assert_array_equal(whitened(columns, np.zeros(INSTRUMENTS), 2), columns[2:])


def test_a_column_is_left_out_of_the_others():
    columns = np.random.default_rng(3).standard_normal((ROWS, 5))
    for column in (0, 1):
        others = [k for k in range(5) if k != column]
        apart = left_by(columns[:, [column]], columns[:, others])
        left = without(columns.T @ columns, column)
        np.testing.assert_allclose(left[np.ix_(others, others)], apart.T @ apart, rtol=1e-6)
        assert not left[column].any()
        assert not left[:, column].any()


@pytest.mark.parametrize("joint", list(itertools.product((-1.0, 0.0, 1.0), repeat=3)))
def test_the_least_of_each_sign_is_that_of_non_negative_least_squares(joint):
    rng = np.random.default_rng(4)
    columns = rng.standard_normal((ROWS, 4)) + rng.standard_normal((ROWS, 1))  # alike in part
    m = columns[:, 1:] @ joint + 0.3 * rng.standard_normal(ROWS)
    square = np.column_stack([columns, m])
    found = left_by_each_sign(square.T @ square)
    expected = [scipy.optimize.nnls(columns[:, 1:], sign * m)[1] ** 2 for sign in (1.0, -1.0)]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_columns_that_are_alike_or_nothing_have_a_solution():
    one = np.ones((4, 4))
    np.testing.assert_allclose(one @ solved_for(one, np.ones(4)), np.ones(4), rtol=1e-6)
    assert left_by_each_sign(np.zeros((5, 5))) == (0.0, 0.0)
    assert left_by_each_sign(np.ones((5, 5))) == pytest.approx((0.0, 1.0), abs=1e-6)


def test_three_equations_are_solved_in_any_order():
    rng = np.random.default_rng(5)
    matrix, right = rng.standard_normal((3, 3)), rng.standard_normal(3)
    for order in itertools.permutations(range(3)):
        rows = list(order)
        found = solved(*matrix[rows].ravel(), *right[rows])
        np.testing.assert_allclose(found, np.linalg.solve(matrix, right))
    assert solved(*(0.0,) * 9, 1.0, 1.0, 1.0) == (0.0, 0.0, 0.0)


# --- false alarms


@pytest.mark.parametrize("order", [1, 4])
@pytest.mark.parametrize("rows", [24, 48, 96])
def test_the_quantiles_are_those_of_a_beta_distribution(rows, order):
    """With four instruments I_x(a, 2) = xᵃ (1 + a (1 − x)), a = (rows − 4 − 2 p)/2."""
    a = 0.5 * (rows - 4 - 2 * order)
    left = max_left(rows, order)
    assert left.order == order
    for x, part in ((left.at_once, FALSE_ALARMS), (left.if_early, IF_EARLY)):
        assert x**a * (1.0 + a * (1.0 - x)) == pytest.approx(part)
    assert (FALSE_ALARMS, IF_EARLY, INSTRUMENTS, PASSES) == (1e-10, 1e-3, 4, 2)


def seems_an_answer(columns, order, part):
    """Return whether R/(R + ‖P e‖²) is below the quantile of a part of all looks, in each pass."""
    x = scipy.special.betaincinv(0.5 * (len(columns) - 4 - 2 * order), 2.0, part)
    weights = np.zeros(INSTRUMENTS)
    for _ in range(PASSES):
        noise, answer, weights = explained_answer(whitened(columns, weights, order))
        if not noise < x * (noise + answer[-1, -1]):
            return False
    return True


@pytest.mark.parametrize("colour", [0.0, 0.7, -0.5])
def test_noise_alone_looks_like_an_answer_about_as_often_as_it_should(colour):
    rng, seen = np.random.default_rng(6), 0
    for _ in range(1000):
        columns = rng.standard_normal((ROWS, INSTRUMENTS + 5))
        columns[:, -1] = scipy.signal.lfilter([1.0], [1.0, -colour], columns[:, -1])
        seen += seems_an_answer(columns, 1, 0.01)
    assert 3 <= seen <= 25, seen


# --- windows of joints


def window(joint, noise=0.0, unmoved=0.1, seed=7, rows=ROWS):
    """Return a window in which the perturbation moves a joint, and something else a little.

    `joint` are the coefficients of (j, a, v, q), which here are one instrument each.
    """
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((rows + BEFORE + 2, 2))
    x = np.column_stack([z[2:, 0], z[2:, 1], z[1:-1, 1], z[:-2, 1]])
    x += unmoved * rng.standard_normal(x.shape)
    m = x @ joint + noise * rng.standard_normal(len(x))
    return np.column_stack([z[2:], x, m])


JOINT = np.array([0.0, 0.3, 1.0, 0.5])
LEFT = max_left(ROWS, 1)


@pytest.mark.parametrize("size", [1.0, 1e-6])
@pytest.mark.parametrize("shows_inertia", [True, False])
def test_a_joint_of_the_wrong_sign_is_told_from_one_of_the_right_sign(size, shows_inertia):
    assert sign_is_wrong(size * window(-JOINT, 0.05), shows_inertia, LEFT)
    assert not sign_is_wrong(size * window(JOINT, 0.05), shows_inertia, LEFT)


@pytest.mark.parametrize("seed", range(20))
def test_nothing_is_said_where_noise_hides_the_answer(seed):
    for sign in (-1.0, 1.0):
        assert not sign_is_wrong(window(sign * JOINT, 10.0, seed=seed), True, LEFT)


def test_each_coefficient_alone_shows_the_sign():
    for k in (1, 2, 3):
        joint = np.zeros(4)
        joint[k] = 1.0
        assert sign_is_wrong(window(-joint, 0.01), True, LEFT)
        assert not sign_is_wrong(window(joint, 0.01), True, LEFT)


def test_an_inertia_that_the_ticks_turn_round_is_no_wrong_sign_unless_it_would_be_shown():
    alone = np.array([0.0, -1.0, 0.0, 0.0])
    assert sign_is_wrong(window(alone, 0.01), True, LEFT)
    assert not sign_is_wrong(window(alone, 0.01), False, LEFT)
    assert not sign_is_wrong(window(np.array([0.0, -1.0, 0.2, 0.1]), 0.01), False, LEFT)


def test_a_torque_that_is_early_is_no_wrong_sign():
    """Its j takes the place of a damping that is not there."""
    early = np.array([-1.0, 0.0, -0.05, 0.0])
    assert not sign_is_wrong(window(early, 0.001), True, LEFT)
    x = LEFT._replace(if_early=1.0)
    assert not sign_is_wrong(window(np.array([-1.0, 0.0, 0.05, 0.0]), 0.001), True, x)


def test_a_motion_that_the_perturbation_does_not_cause_shows_nothing():
    """A subject who moves the drive: M = −J_c θ'' − B_c θ', and the perturbation explains none."""
    moved = window(-JOINT, 0.0)
    moved[:, :2] = np.random.default_rng(8).standard_normal((len(moved), 2))
    assert not sign_is_wrong(moved, True, LEFT)


def an_answer(a):
    """Return R, P and weights of a torque that is a multiple of a, with little noise."""
    columns = np.eye(5)[:, :4]
    square = np.column_stack([columns, columns @ np.array([0.0, a, 0.0, 0.0])])
    return 1e-3, square.T @ square, np.full(INSTRUMENTS, a)


A_WRONG, A_RIGHT = an_answer(-1.0), an_answer(1.0)


@pytest.mark.parametrize(
    ("first", "second", "wrong"),
    [(A_WRONG, A_WRONG, True), (A_RIGHT, A_WRONG, False), (A_WRONG, A_RIGHT, False)],
)
def test_the_sign_has_to_be_wrong_with_the_noise_of_each_pass(monkeypatch, first, second, wrong):
    seen, results = [], iter((first, second))
    monkeypatch.setattr(torque_sign, "explained_answer", lambda _: next(results))
    monkeypatch.setattr(
        torque_sign, "whitened", lambda *given: seen.append((given[1][0], given[2])) or given[0]
    )
    left = LEFT._replace(order=3)
    assert sign_is_wrong(window(-JOINT, 0.05), True, left) == wrong
    assert seen[0] == (0.0, 3)
    assert seen[1:] == ([(-1.0, 3)] if first is A_WRONG else [])
