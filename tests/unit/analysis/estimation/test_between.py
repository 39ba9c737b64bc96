"""Epochs that differ by more than their errors, and bands that contradict an estimate."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from rigidimeter.analysis.estimation.between import (
    band_estimates,
    band_finding,
    between_epochs,
    scatter,
)
from rigidimeter.analysis.estimation.grid import grid_of
from rigidimeter.analysis.estimation.observation import Caused, Observation
from rigidimeter.core.records import BandEstimate, Channel, Epoch, Fit, Outcome
from rigidimeter.core.settings import DiagnosticsSettings, Settings

CHECKS = DiagnosticsSettings()
TRUTH = np.array([0.0045, 0.1368, 1.751])
SE = np.array([1e-4, 4e-3, 0.05])


def test_of_two_epochs_it_is_welchs_t_test():
    rng = np.random.default_rng(0)
    a, b = rng.normal(0, 1, 8), rng.normal(1, 3, 12)
    means = np.array([a.mean(), b.mean()])
    errors = np.array([stats.sem(a), stats.sem(b)])
    found = scatter(2, means, errors, np.array([7.0, 11.0]))
    assert found.p == pytest.approx(stats.ttest_ind(a, b, equal_var=False).pvalue, rel=1e-9)


def fits(values, se=SE):
    half = stats.t.ppf(0.975, 20.0) * se
    return [
        Fit(
            "a", str(i), "OFF", "iv", Outcome(), one, se, one - half, one + half, se, np.diag(se**2)
        )
        for i, one in enumerate(values)
    ]


def drawn(rng, cv=0.0):
    """Return ten epochs, errors estimated with 20 degrees of freedom; K differs by ± cv."""
    own = TRUTH * (1 + np.outer(cv * rng.choice([-1.0, 1.0], 10), [0, 0, 1]))
    se = SE * np.sqrt(rng.chisquare(20, (10, 3)) / 20)
    values = own + SE * rng.standard_normal((10, 3))
    return [fits([one], its)[0] for one, its in zip(values, se, strict=True)]


def test_epochs_of_one_joint_are_seldom_told_apart_and_others_with_their_range():
    rng = np.random.default_rng(1)
    # At .5 % 300 sets give 6 or more in 0.4 % of cases.
    assert sum(between_epochs(drawn(rng), True, CHECKS) is not None for _ in range(300)) < 6
    found = [between_epochs(drawn(rng, 0.2), True, CHECKS) for _ in range(30)]
    assert np.mean([one.value for one in found]) == pytest.approx(42.0, abs=6.0)
    assert {one.facts["symbol"] for one in found} == {"K"}


def test_a_trend_is_named():
    rising = fits(TRUTH * (1 + np.outer(np.linspace(-0.2, 0.2, 10), [0, 0, 1])))
    found = between_epochs(rising, True, CHECKS)
    assert found.facts["trend"] == ", rising by 40 % over the epochs"
    assert found.facts["low"] == pytest.approx(1.41, abs=0.01)


def test_what_bends_the_inertia_as_much_bends_least_squares():
    bent = np.array([-0.2, 0.2, -0.1, 0.1, 0.0, 0.2])
    pushed, stiffer = (fits(TRUTH * (1 + np.outer(bent, [j, j, 1]))) for j in (1.5, 0.0))
    assert between_epochs(pushed, False, CHECKS) is None
    assert between_epochs(pushed, True, CHECKS) is not None
    assert between_epochs(stiffer, False, CHECKS) is not None
    assert between_epochs(stiffer[:2], True, CHECKS) is None
    assert between_epochs([replace(one, se=0 * SE) for one in stiffer], True, CHECKS) is None


class Itself:
    """The cause of a motion that holds nothing else."""

    def __init__(self, grid, lines):
        self.grid, self.lines = grid, lines

    def at(self, joint):
        return Caused(self.lines, np.empty((2, 0)))


def seen(rng, sd_nm=1.0, missing_nm_s=0.0, truth=TRUTH):
    """Return lines of a joint, white noise on its torque; what is missing grows with frequency."""
    t = np.arange(2000) / 100.0
    channels = {n: Channel(n, t, np.zeros(2000)) for n in ("torque_nm", "angle_rad")}
    grid = grid_of(list(channels.values()), (0.075, 28.0), 1.0)
    omega = grid.omega_rad_s
    angle, noise = rng.standard_normal((2, omega.size, 2)) @ [1.0, 1j]
    motion = angle[:, None] * np.stack([-(omega**2), 1j * omega, np.ones(omega.size)], axis=1)
    torque = motion @ truth + missing_nm_s * np.abs(omega) * angle + sd_nm * noise
    wider = Observation(
        *(Epoch("made", "1", channels), Settings(), grid, torque, motion),
        *(np.empty((2, 0)), None, np.empty((0, *motion.shape))),
        cause=Itself(grid, motion),
    )
    first, last = np.searchsorted(grid.line, [2, 401])
    return replace(wider.part(slice(first, last)), wider=wider)


def bands(*epochs, values=TRUTH):
    return band_estimates(epochs, [values] * len(epochs))


def test_bands_are_those_of_the_edges_moved_and_the_halves_those_of_the_fit():
    edges = [
        (round(c.low_hz, 2), round(c.high_hz, 2), c.part)
        for c in bands(seen(np.random.default_rng(1)))
    ]
    assert edges == [
        *((low, high, "all") for low, high in ((0.1, 20.0), (0.05, 20.0), (0.25, 20.0))),
        *((low, high, "all") for low, high in ((0.55, 20.0), (0.1, 10.0), (0.1, 14.0))),
        (0.1, 28.0, "all"),
        *((0.1, 20.0, part) for part in ("first half", "second half")),
    ]


def test_a_change_is_that_of_the_problem_of_those_lines_alone():
    made = seen(np.random.default_rng(1), sd_nm=1e-9, missing_nm_s=0.01)
    wide = made.wider
    left = np.abs(wide.torque_nm - wide.motion @ TRUTH) ** 2
    # The residual's power is smooth enough here to be known without the module's smoother.
    power = np.convolve(np.pad(left, 40, mode="edge"), np.ones(41), "same")[40:-40]
    frequency_hz = wide.grid.omega_rad_s / (2 * np.pi)
    for found in bands(made)[:-2]:
        inside = (frequency_hz > found.low_hz - 1e-9) & (frequency_hz < found.high_hz + 1e-9)
        weighted = (wide.motion / power[:, None])[inside].conj().T
        there = np.linalg.solve(
            (weighted @ wide.motion[inside]).real, (weighted @ wide.torque_nm[inside]).real
        )
        assert np.array(found.value) == pytest.approx(there, rel=0.05)


def test_joints_that_differ_between_epochs_are_no_change_with_the_band():
    rng = np.random.default_rng(3)
    joints = [TRUTH * factors for factors in ((1, 1, 0.8), (1, 1.2, 1), (1, 0.9, 1.3))]
    epochs = [seen(rng, 1e-6, truth=joint) for joint in joints]
    for found in band_estimates(epochs, joints):
        assert np.array(found.change) / TRUTH == pytest.approx(np.zeros(3), abs=1e-6)


def test_the_error_of_a_change_is_its_own():
    """From 120 epochs: the SD of a change is known to 6 %."""
    rng = np.random.default_rng(2)
    found = [bands(seen(rng))[1:] for _ in range(120)]
    change, se, p = (
        np.array([[getattr(one, of) for one in each] for each in found])
        for of in ("change", "change_se", "p")
    )
    np.testing.assert_allclose(change.std(axis=0), np.sqrt(np.mean(se**2, axis=0)), rtol=0.25)
    assert np.mean(p < 0.05) == pytest.approx(0.04, abs=0.03)


@pytest.mark.parametrize(
    ("percent", "p", "part", "width", "told"),
    [
        (6.0, 1e-6, "all", 1.0, True),
        (6.0, 0.004, "all", 1.0, False),  # of three parameters one is so by chance in 1.2 %
        (2.9, 1e-6, "all", 1.0, False),
        (6.0, 1e-6, "first half", 1.0, False),
        (6.0, 1e-6, "all", 2.5, False),
    ],
    ids=["told", "chance", "small", "a joint that varies", "within the interval"],
)
def test_a_band_that_contradicts_is_told(percent, p, part, width, told):
    half, change = 0.05 * width * TRUTH, (0.0, 0.0, -0.01 * percent * TRUTH[2])
    fit = Fit("a", "1", "OFF", "iv", Outcome(), value=TRUTH, low=TRUTH - half, high=TRUTH + half)
    own = BandEstimate("OFF", 0.1, 30.0, "all", (*TRUTH,), (0, 0, 0), (0, 0, 0), (1, 1, 1))
    other = BandEstimate("OFF", 0.1, 21.0, part, (*TRUTH,), change, (*(1e-3 * TRUTH),), (1, 1, p))
    found = band_finding(fit, [own, other], CHECKS)
    assert bool(found) == told
    if told:
        assert found[0].value == pytest.approx(6.0)
        assert found[0].p == pytest.approx(3e-6)
        assert (found[0].facts["way"], found[0].facts["own_high_hz"]) == ("less", 30.0)
        assert found[0].effect.half_intervals == pytest.approx((0.0, 0.0, 1.2))
