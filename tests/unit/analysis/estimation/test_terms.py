"""What each term makes of a motion, in closed form: scenarios tell it to their noise alone."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import legval
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import TERMS, Motion, prepare
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import parse_settings

Array = NDArray[np.float64]
RATE_HZ, LENGTH_S = 500.0, 10.0
TIME_S = np.arange(int(RATE_HZ * LENGTH_S)) / RATE_HZ
JOINT = np.array([0.0045, 0.137, 1.75])
BAND = {"estimation": {"band_low_hz": 0.5, "band_high_unknown_hz": 20.0}}
BY_NAME = {one.name: one for one in TERMS}


@pytest.fixture(scope="module")
def grid():
    noise = np.random.default_rng(1).standard_normal((2, TIME_S.size))
    both = zip(("torque_nm", "angle_rad"), noise, strict=True)
    epoch = Epoch("made", "1", {n: Channel(n, TIME_S, x) for n, x in both}, task="prbs")
    return prepare([epoch], parse_settings(BAND)).observed[0].grid


def _sines(seed: int) -> tuple[Array, Array, Array]:
    """Return angular frequency, phase and size of what moves, below 10 Hz."""
    rng = np.random.default_rng(seed)
    hz = rng.uniform(0.6, 10.0, 40)
    return 2 * np.pi * hz, rng.uniform(0, 2 * np.pi, 40), 0.02 / (1 + hz)


def _smooth(seed: int, late_s: float = 0.0) -> Array:
    """Return a motion and its first three derivatives."""
    w, phase, size = (one[:, None] for one in _sines(seed))
    turn = w * (TIME_S - late_s) + phase
    parts = np.stack([np.cos(turn), -w * np.sin(turn), -(w**2) * np.cos(turn), w**3 * np.sin(turn)])
    return (size * parts).sum(axis=1)


def _torque(angle: Array) -> Array:
    return JOINT @ angle[2::-1]


def _motion(grid, torque: Array, angle: Array) -> Motion:
    coarse = grid.coarse(angle)
    lines = np.stack([grid.lines(one)[0] for one in angle[2::-1]], axis=1)
    torques = grid.lines(torque, 2).T
    return Motion(grid, coarse[1], coarse[0], lines, torques, JOINT, every=angle[1])


def test_a_delay_is_undone(grid):
    angle, late_s = _smooth(3), 0.006
    late = _torque(_smooth(3, late_s))
    motion = BY_NAME["delay"].bent(_motion(grid, late, angle), np.array([late_s]))
    left = motion.torque[:, 0] - motion.lines @ JOINT
    assert np.max(np.abs(left)) < 2e-3 * np.max(np.abs(motion.torque[:, 0]))


def test_the_limb_behind_a_coupling_is_where_its_torque_takes_it(grid):
    limb, compliance = _smooth(5), 0.02
    torques = np.stack([_torque(limb), _torque(limb[1:]), np.gradient(_torque(limb[1:]), TIME_S)])
    measured = np.append(limb[:3] + compliance * torques, limb[3:], axis=0)
    motion = _motion(grid, torques[0], measured)
    motion = BY_NAME["cuff"].bent(motion, np.array([compliance, 0.0]))
    left = motion.torque[:, 0] - motion.lines @ JOINT
    assert np.max(np.abs(left)) < 2e-3 * np.max(np.abs(motion.torque[:, 0]))


def _legendre(x: Array) -> Array:
    return np.stack([legval(x, np.eye(4)[degree]) for degree in (1, 2, 3)])


def test_columns_are_the_lines_of_their_functions(grid):
    angle = _smooth(6)
    motion = _motion(grid, _torque(angle), angle)
    slow = _legendre((2 * np.arange(TIME_S.size) + 1) / TIME_S.size - 1)
    for name, inner, signals in (
        ("friction", [0.02], [np.tanh(angle[1] / 0.02)]),
        ("damping by direction", [], [np.abs(angle[1])]),
        ("stiffness by angle", [], [angle[0] ** 2, angle[0] ** 3]),
        ("reflex+", [0.05, 0.0], [np.maximum(_smooth(6, 0.05)[1], 0)]),
        ("K over time", [], slow * angle[0]),
        ("B over time", [], slow * angle[1]),
        ("J over time", [], slow * angle[2]),
    ):
        columns = BY_NAME[name].columns(motion, np.array([inner]))
        lines = grid.lines(np.array(signals))[0]
        size = np.max(np.abs(lines), axis=1)
        # What is slow about a product, such as its mean, is in the lowest lines.
        apart = np.max(np.abs(columns - lines)[:, 3:], axis=1)
        assert np.all(apart < 0.03 * size), name


def test_slopes_by_inner_parameters(grid):
    motion = _motion(grid, _torque(_smooth(7)), _smooth(7))
    inner = np.array([0.05, 0.03])
    _, by_delay, by_lag = BY_NAME["reflex"].with_slopes(motion, inner, np.array([True, True]))
    column = BY_NAME["reflex"].columns(motion, inner[None])[0]
    s = 1j * grid.omega_rad_s
    assert by_lag == pytest.approx(-2 * s / (1 + 0.03 * s) * column, rel=1e-3)
    assert np.max(np.abs(by_delay + s * column)) < 0.02 * np.max(np.abs(s * column))
