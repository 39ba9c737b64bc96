"""What the pages on the algebra say, by calculation: lines by parts, the loop's bias, chance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from rigidimeter.analysis.estimation import TERMS, Motion, chance, prepare
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import parse_settings
from rigidimeter.model import Loop

J_B_K = np.array([0.0045, 0.1368, 1.751])
DRAWS = 1000


@pytest.mark.parametrize("noise_nm", [3.0, 30.0])
def test_the_loop_pulls_weighted_least_squares_by_twice_the_covariance_times_the_sum_of_h(
    noise_nm: float,
) -> None:
    """However large the torque is: its lines leave the fit, and the others pull alike."""
    settings = parse_settings({})
    loop = Loop(settings.controller, settings.rig).at_frequency(np.arange(3, 300) / 10)
    per_torque = loop.motion_per_torque((0.0045, 0.1368, 1.751)).T
    rng = np.random.default_rng(5)

    def drawn(*shape: int) -> np.ndarray:
        return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)

    lines = len(per_torque)
    power = np.where(np.arange(lines) < 40, noise_nm, 0.3) ** 2
    caused = -per_torque * drawn(lines)[:, None]
    n = np.sqrt(power) * drawn(DRAWS, lines)
    motion = caused + per_torque * n[..., None]
    torque = motion @ J_B_K + n
    weighted = motion.conj().swapaxes(1, 2) / power
    gram = (weighted @ motion).real
    fitted = np.linalg.solve(gram, (weighted @ torque[..., None]).real)[..., 0]

    covariance = np.linalg.inv(gram.mean(axis=0)) / 2
    pull = 2 * covariance @ per_torque.real.sum(axis=0)
    error = fitted.mean(axis=0) - J_B_K
    chance = np.sqrt(np.diag(covariance) / DRAWS)
    assert np.all(np.abs(error - pull) < 4 * chance + 0.1 * np.abs(pull))
    assert np.abs(error[0]) > 10 * chance[0]


def test_lines_of_derivatives_are_those_of_the_derivatives() -> None:
    time_s = np.arange(8000) / 500
    turn = 2 * np.pi * 3.21
    sine = np.sin(turn * time_s)
    both = {name: Channel(name, time_s, sine) for name in ("torque_nm", "angle_rad")}
    ready = prepare([Epoch("made", "1", both, task="prbs")], parse_settings({}))
    grid = ready.observed[0].grid
    x, rate, bend = grid.lines(sine, 2)
    of_rate = grid.lines(turn * np.cos(turn * time_s))[0]
    assert np.max(np.abs(rate - of_rate)) < 1e-6 * np.max(np.abs(of_rate))
    assert np.max(np.abs(bend + turn**2 * x)) < 1e-6 * np.max(np.abs(bend))


@pytest.mark.parametrize("burst", [1.0, 30.0])
def test_p_of_a_term_is_that_of_the_page_and_holds_whatever_the_sizes_of_blocks(
    burst: float,
) -> None:
    rng = np.random.default_rng(5)
    N, m = 38, 3
    sizes = np.where(np.arange(N) < 4, burst, 1.0)[:, None]
    p = []
    for _ in range(DRAWS):
        blocks = sizes * rng.standard_normal((N, m))
        g = blocks.sum(axis=0)
        T = g @ np.linalg.solve(blocks.T @ blocks, g)
        both = stats.chi2.sf(T, m), stats.beta.sf(T / N, m / 2, (N - m) / 2)
        p.append(min(max(2.0 ** (1 - N), 2 * np.exp(3) / 9 * min(both)), 1.0))
        assert chance(blocks) == pytest.approx(p[-1])
    assert all(np.mean(np.array(p) < level) <= level for level in (0.2, 0.05, 0.01, 0.001))


def test_no_term_is_surer_than_the_signs_of_its_blocks() -> None:
    assert chance(np.ones((12, 1))) == pytest.approx(2.0**-11)
    assert chance(np.ones((3, 3))) == 1.0


def test_signs_alone_do_not_reach_a_small_p_too_often() -> None:
    rng = np.random.default_rng(1)
    sizes = np.exp(rng.normal(0.0, 2.0, (60, 3)))
    p = [chance(sizes * rng.choice([-1.0, 1.0], 60)[:, None]) for _ in range(400)]
    assert all(np.mean(np.array(p) < level) <= level for level in (0.3, 0.1, 0.01))


def test_the_instrument_of_a_square_is_that_of_the_page() -> None:
    """Of x², with c caused and u the rest: c² − mean c'² + 2 u (c − mean c')."""
    time_s = np.arange(8000) / 500
    rng = np.random.default_rng(2)
    both = {
        name: Channel(name, time_s, rng.standard_normal(8000))
        for name in ("torque_nm", "angle_rad")
    }
    ready = prepare([Epoch("made", "1", both, task="prbs")], parse_settings({}))
    grid = ready.observed[0].grid
    count = grid.coarse_window.shape[1]
    c, u = rng.standard_normal((2, count))
    lines = np.zeros((grid.line.size, 3), dtype=complex)
    still = np.zeros(count)
    caused = Motion(grid, still, c, lines, lines, J_B_K, measured=False)
    beside = caused._replace(beside=np.stack([still, u]))
    (term,) = (one for one in TERMS if one.name == "stiffness by angle")
    squares = term.seen(beside, np.zeros((1, 0)))[0]
    others = [np.roll(c, round(k * (np.sqrt(5) - 1) / 2 % 1 * count)) for k in range(1, 14)]
    less = [np.mean(each, axis=0) for each in (others, np.square(others))]
    made = grid.coarse_lines(c**2 - less[1] + 2 * u * (c - less[0]))
    assert squares == pytest.approx(made, abs=1e-9 * np.max(np.abs(made)))
    assert term.seen(caused, np.zeros((1, 0)))[0] == pytest.approx(grid.coarse_lines(c**2))
