"""What the torque holds beside J, B and K: closed forms, and properties that no scenario shows."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from tests.scenarios.scenario import scenario

from rigidimeter.analysis.estimation.answer import answer, case_of, findings_of
from rigidimeter.analysis.estimation.drive import find_drive
from rigidimeter.analysis.estimation.grid import Grid, grid_of
from rigidimeter.analysis.estimation.methods import direct, instrumental, start_of
from rigidimeter.analysis.estimation.observation import loop_of, observe
from rigidimeter.analysis.estimation.score import EVERY, Part, chance, fitted, holm
from rigidimeter.analysis.estimation.solve import Solution, solve
from rigidimeter.analysis.estimation.terms import (
    CUFF,
    DELAY,
    FILTER,
    TERMS,
    Motion,
    over_time,
)
from rigidimeter.core.records import Channel

RATE_HZ, LENGTH_S = 500.0, 10.0
JOINT = np.array([0.0045, 0.137, 1.75])
BY_NAME = {one.name: one for one in TERMS}


@pytest.fixture(scope="module")
def grid() -> Grid:
    time_s = np.arange(int(RATE_HZ * LENGTH_S)) / RATE_HZ
    return grid_of([Channel("torque_nm", time_s, np.zeros(time_s.size))], (0.5, 20.0), 1.0)


def _smooth(grid: Grid, seed: int) -> np.ndarray:
    """Return noise below 10 Hz with its first two derivatives and a function of any time."""
    rng = np.random.default_rng(seed)
    hz = rng.uniform(0.6, 10.0, 40)
    phase, size = rng.uniform(0, 2 * np.pi, 40), 0.02 / (1 + hz)
    turn = 2 * np.pi * hz[:, None] * grid.time_s + phase[:, None]
    w = 2 * np.pi * hz[:, None]
    parts = size[:, None] * np.stack([np.cos(turn), -w * np.sin(turn), -(w**2) * np.cos(turn)])
    return parts.sum(axis=1)


def _motion(grid: Grid, torque: np.ndarray, angle: np.ndarray) -> Motion:
    """Return a measured motion; `angle` and its derivatives, shape (3, n)."""
    coarse = grid.coarse(angle)
    lines = np.stack([grid.lines(one)[0] for one in angle[::-1]], axis=1)
    torques = grid.lines(torque, 2).T
    return Motion(grid, coarse[1], coarse[0], lines, torques, JOINT, every=angle[1])


def _torque(angle: np.ndarray) -> np.ndarray:
    return JOINT @ angle[::-1]


def test_signs_alone_do_not_reach_a_small_probability_too_often() -> None:
    rng = np.random.default_rng(1)
    sizes = np.exp(rng.normal(0.0, 2.0, (60, 3)))
    p = [chance(sizes * rng.choice([-1.0, 1.0], 60)[:, None]) for _ in range(400)]
    for level in (0.01, 0.1, 0.3):
        assert np.mean(np.array(p) < level) <= level


def test_a_column_in_every_block_has_the_least_probability_that_blocks_allow() -> None:
    assert chance(np.ones((20, 1))) == pytest.approx(2.0**-19)
    assert chance(np.ones((3, 3))) == 1.0


def test_holm() -> None:
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])


def test_a_column_that_is_there_is_found_with_its_coefficient(grid: Grid) -> None:
    rng = np.random.default_rng(2)

    def lines(count: int) -> np.ndarray:
        shape = (count, grid.line.size)
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    parts = []
    for e in range(2):
        C = lines(5)
        target = JOINT @ C[:3] + (0.3 if e else 0.0) * C[3] + 0.01 * lines(1)[0]
        parts.append(Part(grid, C, C, target))
    base = [(j, EVERY) for j in range(3)]
    fit = fitted(parts, base, [(3, 0), (3, 1), (4, EVERY)])
    blocks = fit.blocks()
    there = fit.score(blocks, [(3, 1)])
    assert there.p < 1e-5
    assert there.values[0] == pytest.approx(0.3, rel=0.01)
    assert fit.score(blocks, [(3, 0)]).explained < 0.2 * there.explained
    beside = fitted(parts, [*base, (3, 1)], [(4, EVERY)])
    covariance, half = beside.uncertain(beside.blocks())
    assert beside.values == pytest.approx([*JOINT, 0.3], abs=4 * np.max(half))
    assert np.all(np.diag(covariance) > 0)
    assert beside.score(beside.blocks(), [(4, EVERY)]).p > 0.05


def test_a_delay_is_undone(grid: Grid) -> None:
    angle = _smooth(grid, 3)
    late_s = 0.006
    late = scipy.interpolate.CubicSpline(grid.time_s, _torque(angle))(grid.time_s - late_s)
    motion = DELAY.bent(_motion(grid, late, angle), np.array([late_s]))
    left = motion.torque[:, 0] - motion.lines @ JOINT
    assert np.max(np.abs(left)) < 2e-3 * np.max(np.abs(motion.torque[:, 0]))


def test_a_filter_is_undone(grid: Grid) -> None:
    angle = _smooth(grid, 4)
    hz = 40.0
    b, a = scipy.signal.butter(2, 2 * np.pi * hz, analog=True)
    time_s = np.concatenate([grid.time_s - LENGTH_S, grid.time_s])
    rng = np.random.default_rng(4)
    f, phase = rng.uniform(0.6, 10.0, 40), rng.uniform(0, 2 * np.pi, 40)
    before, behind = np.zeros(time_s.size), np.zeros(time_s.size)
    for one, at in zip(f, phase, strict=True):
        gain = scipy.signal.freqs(b, a, [2 * np.pi * one])[1][0]
        before += np.cos(2 * np.pi * one * time_s + at)
        behind += np.abs(gain) * np.cos(2 * np.pi * one * time_s + at + np.angle(gain))
    inside = slice(grid.time_s.size, None)
    motion = _motion(grid, behind[inside], angle)
    undone = FILTER.bent(motion, np.array([1 / (2 * np.pi * hz)]))
    truth = grid.lines(before[inside])[0]
    assert np.max(np.abs(undone.torque[:, 0] - truth)) < 1e-3 * np.max(np.abs(truth))


def test_the_limb_behind_a_coupling_is_where_its_torque_takes_it(grid: Grid) -> None:
    limb = _smooth(grid, 5)
    torque, compliance = _torque(limb), 0.02
    torques = np.stack([torque, np.gradient(torque, grid.time_s), np.zeros(torque.size)])
    torques[2] = np.gradient(torques[1], grid.time_s)
    motion = CUFF.bent(_motion(grid, torque, limb + compliance * torques), np.array([0.02, 0.0]))
    left = motion.torque[:, 0] - motion.lines @ JOINT
    assert np.max(np.abs(left)) < 2e-3 * np.max(np.abs(motion.torque[:, 0]))


def test_columns_are_the_lines_of_their_functions(grid: Grid) -> None:
    angle = _smooth(grid, 6)
    motion = _motion(grid, _torque(angle), angle)
    later = scipy.interpolate.CubicSpline(grid.time_s, np.maximum(angle[1], 0))(grid.time_s - 0.05)
    x = (2 * np.arange(grid.time_s.size) + 1) / grid.time_s.size - 1
    for name, inner, signals in (
        ("friction", [0.02], [np.tanh(angle[1] / 0.02)]),
        ("damping by direction", [], [np.abs(angle[1])]),
        ("stiffness by angle", [], [angle[0] ** 2, angle[0] ** 3]),
        ("reflex+", [0.05, 0.0], [later]),
        ("K over time", [], [*(over_time(x) * angle[0])]),
        ("B over time", [], [*(over_time(x) * angle[1])]),
        ("J over time", [], [*(over_time(x) * angle[2])]),
    ):
        columns = BY_NAME[name].columns(motion, np.array([inner]))
        lines = grid.lines(np.array(signals))[0]
        size = np.max(np.abs(lines), axis=1)
        # What is slow about a product, such as its mean, is in the lowest lines.
        apart = np.max(np.abs(columns - lines)[:, 3:], axis=1)
        assert np.all(apart < 0.03 * size), name


def test_slopes_by_inner_parameters(grid: Grid) -> None:
    motion = _motion(grid, _torque(_smooth(grid, 7)), _smooth(grid, 7))
    inner = np.array([0.05, 0.03])
    _, by_delay, by_lag = BY_NAME["reflex"].with_slopes(motion, inner, np.array([True, True]))
    column = BY_NAME["reflex"].columns(motion, inner[None])[0]
    s = 1j * grid.omega_rad_s
    assert by_lag == pytest.approx(-2 * s / (1 + 0.03 * s) * column, rel=1e-3)
    assert np.max(np.abs(by_delay + s * column)) < 0.02 * np.max(np.abs(s * column))


def _solution(perturbation: bool = True, **changes: dict) -> tuple[Solution, np.ndarray]:
    row = scenario("a joint", **changes)
    made, settings = row.simulated(0, 2), row.analysed_with()
    drive = find_drive(made.epochs, settings)
    causes = [] if perturbation else None
    loop = loop_of(settings, made.epochs[0].channels["torque_nm"].rate_hz, drive)
    seen = [observe(one, settings, drive, loop, causes) for one in made.epochs]
    return solve(seen, instrumental if perturbation else direct, start_of(seen)), np.mean(
        made.truth, axis=0
    )


@pytest.mark.parametrize("perturbation", [True, False])
def test_a_reflex_beside_torque_of_the_subject_is_answered(perturbation: bool) -> None:
    reflex = {"reflex_nm_s_rad": 0.1, "reflex_delay_s": 0.058, "reflex_sides": 1.0}
    solution, truth = _solution(perturbation, joint=reflex, subject={"voluntary_nm": 0.2})
    found = answer(solution)
    (one,) = found.found
    assert one.term.name == "reflex+"
    assert one.values[0] == pytest.approx(0.1, abs=2 * one.half[0])
    assert one.inner[0] == pytest.approx(0.058, abs=2 * one.inner_half[0])
    assert found.answered
    assert np.all(np.abs(found.joint - truth) < 2 * found.half)
    assert abs(solution.values[1] - truth[1]) > 0.1 * truth[1]
    settings = solution.problems[0].observation.settings
    (told,) = findings_of(found, settings)
    assert told.name == "missing_term"
    assert told.facts["late_ms"] == pytest.approx(58, abs=1)
    assert not [one for one in answer(solution, person=False).found if one.term.muscle]


def test_nothing_is_found_where_nothing_is() -> None:
    solution, _ = _solution()
    found = answer(solution)
    assert not found.found
    assert found.answered
    assert found.joint == pytest.approx(solution.values, rel=1e-3)
    settings = solution.problems[0].observation.settings
    assert findings_of(found, settings) == ()
    case = case_of(solution.problems)
    assert case.caused


def test_what_has_no_name_withholds_the_answer() -> None:
    resists = {"resist_nm_rad": 0.5, "reflex_delay_s": 0.12, "reflex_hz": 2.0}
    solution, truth = _solution(joint=resists)
    found = answer(solution)
    right = np.all(np.abs(found.joint - truth) < 2 * found.half + 0.01 * truth)
    assert right or not found.answered
