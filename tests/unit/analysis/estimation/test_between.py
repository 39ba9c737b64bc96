"""Epochs that differ by more than their errors, and bands that contradict an estimate."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.scenario import scenario

import rigidimeter as rm
from rigidimeter.analysis.estimation import between_epochs
from rigidimeter.core.records import Fit, Outcome
from rigidimeter.core.settings import DiagnosticsSettings, changed_settings

CHECKS = DiagnosticsSettings()
TRUTH = np.array([0.0045, 0.1368, 1.751])
SE = np.array([1e-4, 4e-3, 0.05])


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


@pytest.fixture(scope="module")
def recording():
    row = scenario("a joint")
    epochs = row.simulated(0, 2).epochs
    return epochs, row.analysed_with(), rm.estimate(epochs, "iv", settings=row.analysed_with())


def edges(found):
    return [(round(one.low_hz, 2), round(one.high_hz, 2), one.part) for one in found.sensitivity]


def test_bands_are_those_of_the_edges_moved_and_the_halves_those_of_the_fit(recording):
    assert edges(recording[2]) == [
        *((low, high, "all") for low, high in ((0.1, 30.0), (0.05, 30.0), (0.25, 30.0))),
        *((low, high, "all") for low, high in ((0.55, 30.0), (0.1, 15.0), (0.1, 21.0))),
        (0.1, 42.0, "all"),
        *((0.1, 30.0, part) for part in ("first half", "second half")),
    ]


@pytest.mark.parametrize("band", [2, 4, 6], ids=["0.3 Hz", "15 Hz", "42 Hz"])
def test_what_a_band_gives_is_an_estimate_in_that_band(recording, band):
    epochs, settings, whole = recording
    moved = whole.sensitivity[band]
    # The line below the band counts.
    its = {"band_low_hz": moved.low_hz + 0.05, "band_high_closed_loop_hz": moved.high_hz}
    (pooled,) = rm.estimate(
        epochs, "iv", settings=changed_settings(settings, {"estimation": its})
    ).pooled
    apart = np.array(moved.value) - pooled.value
    assert np.all(np.abs(apart) < 0.2 * np.array(moved.change_se))
    assert np.max(np.abs(moved.change) / np.array(moved.change_se)) > 0.3


def test_joints_that_differ_between_epochs_are_no_change_with_the_band():
    row = SCENARIOS["K 0.6, 1.2, 0.8, 1.4 by epoch"]
    epochs, truth = row.simulated(0, 4)
    found = rm.estimate(epochs, "iv", settings=row.analysed_with())
    assert "varying_between_epochs" in {one.name for one in found.pooled[0].findings}
    for band in found.sensitivity:
        assert np.array(band.change) / truth[0] == pytest.approx(np.zeros(3), abs=1e-3)


def test_the_error_of_a_change_is_its_own():
    """From 20 recordings, bands that overlap: the mean square is known to 25 %."""
    row = scenario("a short epoch", perturbation={"duration_s": 8.0})
    found = [
        rm.estimate([epoch], "iv", settings=row.analysed_with()).sensitivity[1:]
        for epoch in row.simulated(0, 20).epochs
    ]
    change, se, p = (
        np.array([[getattr(one, of) for one in each] for each in found])
        for of in ("change", "change_se", "p")
    )
    assert np.mean((change / se) ** 2) == pytest.approx(1.0, abs=0.6)
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.05)
