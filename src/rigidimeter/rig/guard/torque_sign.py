"""Whether the torque answers the perturbation with the right sign: a test of likelihoods.

Whatever is mounted on the drive, the torque M from the drive on it is

    M = J θ'' + B θ' + K (θ − θ0) − M_sub        J, B, K ≥ 0

and with a sensor of the wrong sign minus that. Only what the perturbation M_p causes can tell the
two apart: a subject who pushes moves the drive as well, and M = −J_c θ'' − B_c θ' looks like a
joint with a negative inertia. What the controller would do with M_p alone, without any torque, is
known: J_c θ_p'' + B_c θ_p' = M_p. It has nothing to do with the subject. All signals pass one
filter, which leaves out θ0 and differentiates without amplifying noise:

    F = H L³        L = w/(s + w)        H = 1 − L
    q = F θ         v = w H² L² θ        a = w² H³ L θ        j = w³ H⁴ θ

A row of the window is (q_p, v_p, j, a, v, q, M). The instruments z are q_p and v_p of a row and v_p
of the two before, which hold what M_p moves late by up to 30 ms and, nearly, by more.

noise    Third differences of the rows leave out what is slow: the subject's torque falls with the
         frequency, and a fast part of the answer is left. 1 − φ₁ D − … − φ_p D^p makes the noise
         next to white, D being one row's delay. All columns pass it. R is what z then leaves of the
         square of M. φ is first from least squares on M itself, as if none of it was an answer:
         from what z leaves of M it could not tell a noise that z explains by chance. Then it is
         from what z leaves, with the weights of z that the columns made white gave. The sign has to
         be wrong with either.

order    A tremor is a line whose phase wanders: p = 2, and 4 with its first harmonic. Of 96 rows of
         a line at 5 Hz p = 1 leaves a spectrum as of 5 that are independent, which four instruments
         soon explain by chance; p = 2 as of 64, p = 4 as of 73. In a window of 24 rows p = 2 would
         find a wrong sign up to 0.6 s later, and p = 1 leaves few rows to chance.

answer   P is what z explains of the squares and products of (j, a, v, q, M). The least that a joint
         of the right sign leaves of the torque in P is

             Q₊ = min ‖M_P − (J a + B v + K q)_P‖²        over J, B, K ≥ 0

         and Q₋ over J, B, K ≤ 0. With ticks so slow that the drive comes to its velocity before the
         next one, torques read at the ticks miss the acceleration, or show its overshoot: then J
         may have any sign.

test     With white Gaussian noise R/(R + ‖P e‖²) has the distribution Beta(f/2, r/2), with r
         instruments and f the rows less r and 2 p, whatever the joint,
         the motion and the size of the noise. As Q₊ ≤ ‖P e‖² where the sign is right,

             (R + Q₋)/(R + Q₊) < x

         then happens in at most the part α of all looks, x being the quantile of α. The left side
         is the ratio of the likelihoods of the two signs, to the power 2/rows. A torque that is
         early by τ adds −J τ j, next to which a small B v is lost: so a joint with any multiple of
         j in its torque has to be unlikely as well, if not as much.

Like the steps of the guard it only adds, multiplies, divides, compares and takes square roots.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

COLUMNS = 7
INSTRUMENTS = 4
LAGS = INSTRUMENTS - 2
JERK, ACCELERATION = 0, 1
"""Where j and a stand in (j, a, v, q, M)."""
MOVED = INSTRUMENTS + 2
"""Where v stands in the columns, after a."""

DIFFERENCES = 3
BEFORE = LAGS + DIFFERENCES
"""Rows before the first of a window that its lags and differences reach back to."""

FALSE_ALARMS = 1e-10
"""α. No subject's torque is quite white, so `benchmarks.false_alarms` counts. It is not that of a
tremor that keeps the phase of a perturbation of one frequency; a PRBS has many."""

IF_EARLY = 1e-3
"""α where the torque may be early or late."""

PASSES = 2
"""With φ of M, and of what z leaves of it."""

SINGULAR = 1e-9
"""Of a square of 1, is added to each; else two columns that are alike had no solution."""


class Left(NamedTuple):
    """What a joint of the right sign may leave: x for each α, with noise of the order p."""

    order: int = 1
    at_once: float = 0.0
    if_early: float = 0.0


def max_left(rows: int, order: int) -> Left:
    """Return x for a window of so many rows."""
    free = rows - INSTRUMENTS - 2 * order
    quantiles = scipy.special.betaincinv(
        0.5 * free, 0.5 * INSTRUMENTS, np.array([FALSE_ALARMS, IF_EARLY])
    )
    return Left(order, *quantiles.tolist())


def sign_is_wrong(window: Array, shows_inertia: bool, left: Left) -> bool:
    """Return whether a window shows the wrong sign.

    Parameters
    ----------
    window : array, shape (rows + BEFORE, COLUMNS)
    shows_inertia : bool
        Whether torques read at the ticks do; else J may have any sign.
    left : Left
        As `max_left` gives it for the rows and the order of the noise.
    """
    columns = difference_columns(window)
    m = columns[:, -1]
    if (m * columns[:, MOVED]).sum() > 0.0 and (m * columns[:, MOVED - 1]).sum() > 0.0:
        return False  # it accelerates and brakes the joint as the right sign does
    weights = np.zeros(INSTRUMENTS)
    for _ in range(PASSES):
        noise, answer, weights = explained_answer(whitened(columns, weights, left.order))
        if not shows_inertia:
            answer = without(answer, ACCELERATION)
        if not fits_better(noise, answer, left.at_once):
            return False
        if not fits_better(noise, without(answer, JERK), left.if_early):
            return False
    return True


def fits_better(noise: float, answer: Array, limit: float) -> bool:
    """Return whether the wrong sign leaves less than this part of what the right one leaves."""
    plus, minus = left_by_each_sign(answer)
    return bool(noise + minus < limit * (noise + plus))


def difference_columns(window: Array) -> Array:
    """Return third differences of (q_p, v_p, v_p of the two rows before, j, a, v, q, M).

    The square of each column is 1, but that of a column of nothing, which stays 0.
    """
    once = window[1:] - window[:-1]
    twice = once[1:] - once[:-1]
    fast = twice[1:] - twice[:-1]
    rows = fast.shape[0] - LAGS
    columns = np.empty((rows, INSTRUMENTS + COLUMNS - 2))
    columns[:, 0] = fast[LAGS:, 0]
    for lag in range(LAGS + 1):
        columns[:, 1 + lag] = fast[LAGS - lag : LAGS - lag + rows, 1]
    columns[:, INSTRUMENTS:] = fast[LAGS:, 2:]
    squares = (columns * columns).sum(axis=0)
    return columns / np.sqrt(np.where(squares > 0.0, squares, 1.0))


def explained_answer(columns: Array) -> tuple[float, Array, Array]:
    """Return R, P of (j, a, v, q, M), and the weights with which z is nearest to M."""
    n = INSTRUMENTS
    s = columns.T @ columns
    by = s[:n, n:].copy()
    weights = solved_for(s[:n, :n], by)
    p: Array = by.T @ weights
    return float(s[-1, -1] - p[-1, -1]), p, weights[:, -1].copy()


def whitened(columns: Array, weights: Array, order: int) -> Array:
    """Return the columns less what the last rows predict of each, if what z leaves is noise."""
    noise = columns[:, -1] - columns[:, :INSTRUMENTS].copy() @ weights
    rows = noise.shape[0]
    past = np.empty((order, rows - order))
    for k in range(order):
        past[k] = noise[order - 1 - k : rows - 1 - k]
    square = (noise * noise).sum()
    scale = 1.0 / square if square > 0.0 else 0.0
    phi = solved_for(scale * (past @ past.T), scale * (past @ noise[order:]))
    white = columns[order:].copy()
    for k in range(order):
        white -= phi[k] * columns[order - 1 - k : rows - 1 - k]
    return white


def solved_for(s: Array, right: Array) -> Array:
    """Solve s x = right for squares and products s of columns that may be alike."""
    regular = s.copy()
    for i in range(s.shape[0]):
        regular[i, i] += SINGULAR
    return np.asarray(np.linalg.solve(regular, right), dtype=np.float64)


def without(s: Array, column: int) -> Array:
    """Return what one column leaves of the squares and products of the others, and 0 of itself."""
    scale = 1.0 / (float(s[column, column]) + SINGULAR)
    product = s[:, column : column + 1] * s[column : column + 1]
    left = s - scale * product
    left[column, :] = left[:, column] = 0.0
    return left


def left_by_each_sign(g: Array) -> tuple[float, float]:
    """Return the least that coefficients of a, v and q ≥ 0, and ≤ 0, leave of the square of M.

    Each subset of them is solved for, the others being 0.
    """
    aa, av, aq, am = float(g[1, 1]) + SINGULAR, float(g[1, 2]), float(g[1, 3]), float(g[1, 4])
    vv, vq, vm = float(g[2, 2]) + SINGULAR, float(g[2, 3]), float(g[2, 4])
    qq, qm = float(g[3, 3]) + SINGULAR, float(g[3, 4])
    plus = minus = float(g[4, 4])
    for has_a in (0.0, 1.0):
        for has_v in (0.0, 1.0):
            for has_q in (0.0, 1.0):
                j, b, k = solved(
                    *(has_a * aa + 1.0 - has_a, has_a * has_v * av, has_a * has_q * aq),
                    *(has_a * has_v * av, has_v * vv + 1.0 - has_v, has_v * has_q * vq),
                    *(has_a * has_q * aq, has_v * has_q * vq, has_q * qq + 1.0 - has_q),
                    *(has_a * am, has_v * vm, has_q * qm),
                )
                left = float(g[4, 4]) - j * am - b * vm - k * qm
                if j >= 0.0 and b >= 0.0 and k >= 0.0:
                    plus = min(plus, left)
                if j <= 0.0 and b <= 0.0 and k <= 0.0:
                    minus = min(minus, left)
    return max(plus, 0.0), max(minus, 0.0)


def solved(
    a: float,
    b: float,
    c: float,
    d: float,
    e: float,
    f: float,
    g: float,
    h: float,
    i: float,
    p: float,
    q: float,
    r: float,
) -> tuple[float, float, float]:
    """Solve [[a b c] [d e f] [g h i]] x = (p, q, r) by Cramer's rule; zeros where none is."""
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    if not abs(determinant) > 0.0:
        return 0.0, 0.0, 0.0
    x = p * (e * i - f * h) - b * (q * i - f * r) + c * (q * h - e * r)
    y = a * (q * i - f * r) - p * (d * i - f * g) + c * (d * r - q * g)
    z = a * (e * r - q * h) - b * (d * r - q * g) + p * (d * h - e * g)
    return x / determinant, y / determinant, z / determinant
