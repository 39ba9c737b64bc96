"""How large the answer must be for its sign to be found: S/N > (f/n) (1/x_n − 1).

That leaves out what the wrong sign leaves of the noise, and that both passes must agree: half of
all draws are found at 1.2 to 1.4 times as much.
"""

import numpy as np
import pytest

from rigidimeter.rig.guard import (
    INSTRUMENTS,
    NOISE_ORDERS,
    PASSES,
    ROWS,
    explained_answer,
    fits_better,
    max_left,
    whitened,
)

NEEDED = {24: 11.7, 48: 2.19, 96: 0.75}


def found(rows, order, ratio, draws=200):
    """Return in which part of all draws the wrong sign is found, the answer being −a √ratio.

    The noise of a row is white, with a square of 1.
    """
    rng, seen = np.random.default_rng(rows), 0
    left = max_left(rows, order)
    for _ in range(draws):
        columns = rng.standard_normal((rows, INSTRUMENTS + 5))
        columns[:, INSTRUMENTS + 1 : -1] = columns[:, :3]  # each moves one of a, v and q
        columns[:, -1] -= np.sqrt(ratio) * columns[:, 0]
        weights, wrong = np.zeros(INSTRUMENTS), True
        for _ in range(PASSES):
            noise, answer, weights = explained_answer(whitened(columns, weights, order))
            wrong = wrong and fits_better(noise, answer, left.at_once)
        seen += wrong
    return seen / draws


@pytest.mark.parametrize(("rows", "order"), [*zip(ROWS, NOISE_ORDERS, strict=True)])
def test_a_sign_is_found_where_the_ratio_of_likelihoods_is_enough(rows, order):
    left, f = max_left(rows, order), rows - INSTRUMENTS - 2 * order
    needed = f / rows * (1.0 / left.at_once - 1.0)
    assert needed == pytest.approx(NEEDED[rows], rel=0.005)
    assert found(rows, order, 2.0 * needed) > 0.75
    assert found(rows, order, 0.6 * needed) < 0.05
