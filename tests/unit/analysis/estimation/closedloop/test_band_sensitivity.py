"""How the estimate changes with the band: exactly, with its own error, and by chance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from rigidimeter.analysis.estimation.closedloop.band_sensitivity import Member, band_changes
from rigidimeter.analysis.estimation.closedloop.grid import epoch_grid
from rigidimeter.analysis.estimation.closedloop.normal_equations import Problem
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.core.records import Channel, Epoch

TIME_S = np.arange(2000) / 100.0
TRUTH = np.array([0.0045, 0.1368, 1.751])
FIT_HZ, WIDE_HZ = (0.15, 20.0), (0.075, 28.0)


def grid(band_hz):
    channels = {n: Channel(n, TIME_S, np.zeros(2000)) for n in ("torque_nm", "angle_rad")}
    return epoch_grid(Epoch("made", "1", channels), band_hz, 1.0)


def noise(rng, size):
    return rng.standard_normal(size) + 1j * rng.standard_normal(size)


def member(rng, sd_nm=1.0, missing_nm_s=0.0, truth=TRUTH):
    """Return lines of a joint, white noise on its torque; what is missing grows with frequency."""
    wide, fit = grid(WIDE_HZ), grid(FIT_HZ)
    omega = wide.omega_rad_s
    angle = noise(rng, omega.size)
    motion = angle[:, None] * np.stack([-(omega**2), 1j * omega, np.ones(omega.size)], axis=1)
    missing = missing_nm_s * np.abs(omega) * angle
    torque = motion @ truth + missing + sd_nm * noise(rng, omega.size)
    return as_member(Observation(wide, torque, motion), fit, truth)


def as_member(wider, fit, truth):
    """Return an epoch whose motion is its own instrument."""
    problem = Problem(wider.motion, wider.motion, wider.torque_nm, wider.on(fit))
    return Member(problem, truth)


def solved(member, power, part):
    weighted = member.problem.instruments[part] / power[part, None]
    gram = (weighted.conj().T @ member.seen.motion[part]).real
    return np.linalg.solve(gram, (weighted.conj().T @ member.seen.torque_nm[part]).real)


def test_a_change_is_that_of_the_problem_of_those_lines_alone():
    made = member(np.random.default_rng(1), sd_nm=1e-9, missing_nm_s=0.01)
    values, changes = band_changes([made])
    residual = made.seen.torque_nm - made.seen.motion @ TRUTH
    # The residual's power is smooth enough here to be known without the module's smoother.
    power = np.convolve(np.pad(np.abs(residual) ** 2, 40, mode="edge"), np.ones(41), "same")[40:-40]
    frequency_hz = made.seen.grid.omega_rad_s / (2 * np.pi)
    for found in changes[:-2]:
        inside = (frequency_hz > found.low_hz - 1e-9) & (frequency_hz < found.high_hz + 1e-9)
        there = solved(made, power, np.flatnonzero(inside))
        assert values + found.change == pytest.approx(there, rel=0.05)


def test_bands_are_those_of_the_edges_moved_and_the_halves_those_of_the_fit():
    _, changes = band_changes([member(np.random.default_rng(1))])
    edges = [(round(c.low_hz, 2), round(c.high_hz, 2), c.part) for c in changes]
    assert edges == [
        (0.05, 20.0, "all"),
        (0.25, 20.0, "all"),
        (0.55, 20.0, "all"),
        (0.1, 10.0, "all"),
        (0.1, 14.0, "all"),
        (0.1, 28.0, "all"),
        (0.1, 20.0, "first half"),
        (0.1, 20.0, "second half"),
    ]


def test_joints_that_differ_between_epochs_are_no_change_with_the_band():
    """Each alone says the same in every band."""
    rng = np.random.default_rng(3)
    joints = [TRUTH * factors for factors in ((1, 1, 0.8), (1, 1.2, 1), (1, 0.9, 1.3))]
    _, changes = band_changes([member(rng, 1e-6, truth=joint) for joint in joints])
    for found in changes:
        assert found.change / TRUTH == pytest.approx(np.zeros(3), abs=1e-6)


def test_the_error_of_a_change_is_its_own():
    """From 300 epochs: the SD of a change is known to 4 %."""
    rng = np.random.default_rng(2)
    found = [band_changes([member(rng)])[1] for _ in range(300)]
    change = np.array([[one.change for one in changes] for changes in found])
    claimed = np.array([[one.change_se for one in changes] for changes in found])
    np.testing.assert_allclose(change.std(axis=0), np.sqrt(np.mean(claimed**2, axis=0)), rtol=0.2)
    p = np.array([[one.p for one in changes] for changes in found])
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.02)


def test_of_nested_bands_the_error_is_the_difference_of_the_variances():
    """Hausman 1978: where the motion is its own instrument and the weights are right."""
    made = member(np.random.default_rng(3))
    _, changes = band_changes([made])
    lines, narrow = np.flatnonzero, changes[4]
    frequency_hz = made.seen.grid.omega_rad_s / (2 * np.pi)
    variances = []
    for inside in (
        lines((frequency_hz > 0.09) & (frequency_hz < narrow.high_hz + 1e-9)),
        np.arange(made.seen.torque_nm.size)[made.fitted],
    ):
        motion = made.seen.motion[inside]
        # Noise of power 2 in a line.
        variances.append(np.diag(np.linalg.inv((motion.conj().T @ motion).real)))
    expected = np.sqrt(variances[0] - variances[1])
    assert narrow.change_se == pytest.approx(expected, rel=0.25)


def test_epochs_together_know_a_change_better():
    rng = np.random.default_rng(4)
    one = band_changes([member(rng)])[1]
    four = band_changes([member(rng) for _ in range(4)])[1]
    ratio = [b.change_se / a.change_se for a, b in zip(one, four, strict=True)]
    assert np.median(ratio) == pytest.approx(0.5, abs=0.1)


def test_a_half_is_the_window_times_a_half_of_the_epoch():
    """A stiffness that is 20 % more in the first half of a record than in the second."""
    rng = np.random.default_rng(5)
    wide, fit = grid(WIDE_HZ), grid(FIT_HZ)
    course = 1 + 0.1 * np.sin(2 * np.pi * (TIME_S[: wide.time_s.size]) / wide.time_s.size * 100.0)
    angle = rng.standard_normal(wide.time_s.size)
    lines = np.stack([wide.transform(angle * 0), wide.transform(angle * 0), wide.transform(angle)])
    omega = wide.omega_rad_s
    motion = np.stack([-(omega**2) * lines[2], 1j * omega * lines[2], lines[2]], axis=1)
    torque = 1.751 * wide.transform(course * angle) + motion[:, :2] @ TRUTH[:2]
    torque = torque + 0.01 * noise(rng, omega.size)
    made = as_member(Observation(wide, torque, motion), fit, TRUTH)
    values, changes = band_changes([made])
    halves = {c.part: c for c in changes if c.part != "all"}
    # The window ½ (1 + sin) has a mean of sin over it of one half.
    assert halves["first half"].change[2] / values[2] == pytest.approx(0.05, abs=0.02)
    assert halves["second half"].change[2] / values[2] == pytest.approx(-0.05, abs=0.02)


def test_what_a_hole_in_the_window_repeats_widens_the_error():
    made = member(np.random.default_rng(6))
    grid = made.seen.grid
    spread = replace(made.seen, grid=replace(grid, spread=4 * grid.spread))
    other = as_member(spread, made.problem.observation.grid, TRUTH)
    plain, wider = (band_changes([m])[1] for m in (made, other))
    assert wider[0].change_se == pytest.approx(2 * plain[0].change_se, rel=0.01)
    assert np.all(wider[0].p > plain[0].p)


def test_probabilities_are_evenly_distributed():
    rng = np.random.default_rng(7)
    p = [band_changes([member(rng) for _ in range(2)])[1][4].p[0] for _ in range(200)]
    assert stats.kstest(p, "uniform").pvalue > 1e-3
