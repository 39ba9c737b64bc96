"""Epochs that differ by more than their errors, and those that do not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from rigidimeter.analysis.estimation.between_epochs import between_epochs, scatter
from rigidimeter.core.records import Fit, Outcome
from rigidimeter.core.settings import DiagnosticsSettings

SETTINGS = DiagnosticsSettings()
TRUTH = np.array([0.0045, 0.1368, 1.751])
SE = np.array([1e-4, 4e-3, 0.05])


def test_of_two_epochs_it_is_welchs_t_test():
    rng = np.random.default_rng(0)
    a, b = rng.normal(0, 1, 8), rng.normal(1, 3, 12)
    means, errors = (
        np.array([of(part) for part in (a, b)])
        for of in (np.mean, lambda part: np.std(part, ddof=1) / np.sqrt(part.size))
    )
    found = scatter(2, means, errors, np.array([a.size - 1.0, b.size - 1.0]))
    assert found.p == pytest.approx(stats.ttest_ind(a, b, equal_var=False).pvalue, rel=1e-9)


def test_with_errors_that_are_known_it_is_cochrans_q():
    values, errors = np.array([1.0, 1.3, 0.8, 1.1]), np.array([0.1, 0.2, 0.1, 0.3])
    weight = errors**-2
    Q = weight @ (values - weight @ values / weight.sum()) ** 2
    found = scatter(2, values, errors, np.full(4, 1e9))
    assert found.p == pytest.approx(stats.chi2.sf(Q, 3), rel=1e-6)


def fits(values, se=SE, degrees=20.0):
    half = stats.t.ppf(0.975, degrees) * se
    return [
        Fit(
            *("a", str(i), "OFF", "iv", Outcome(), value, se, value - half, value + half, se),
            np.diag(se**2),
        )
        for i, value in enumerate(values)
    ]


def drawn(rng, count, cv=(0.0, 0.0, 0.0)):
    own = TRUTH * (1 + np.array(cv) * rng.choice([-1.0, 1.0], (count, 1)))
    # Errors are estimated with 20 degrees of freedom.
    estimated = SE * np.sqrt(rng.chisquare(20, (count, 3)) / 20)
    return [
        fits([value], se)[0]
        for value, se in zip(own + SE * rng.standard_normal((count, 3)), estimated, strict=True)
    ]


def test_epochs_of_one_joint_are_told_apart_as_seldom_as_the_settings_say():
    rng = np.random.default_rng(1)
    alarms = [between_epochs(drawn(rng, 10), True, SETTINGS) is not None for _ in range(600)]
    # At 1 % 600 sets give 13 or more in 0.8 % of cases; a small range is not counted as well.
    assert sum(alarms) <= 12


def test_a_stiffness_that_differs_by_a_fifth_is_found_with_its_range():
    rng = np.random.default_rng(2)
    found = [between_epochs(drawn(rng, 10, (0, 0, 0.2)), True, SETTINGS) for _ in range(50)]
    assert all(finding is not None for finding in found)
    assert np.mean([finding.value for finding in found]) == pytest.approx(42.0, abs=5.0)
    assert {finding.facts["symbol"] for finding in found} == {"K"}
    assert all(1.0 < finding.facts["low"] < finding.facts["high"] for finding in found)
    assert found[0].facts["trend"] == ""


def test_a_trend_is_named():
    rising = fits(TRUTH * (1 + np.outer(np.linspace(-0.2, 0.2, 10), [0, 0, 1])))
    finding = between_epochs(rising, True, SETTINGS)
    assert finding.facts["trend_percent"] == pytest.approx(40.0, abs=1.0)
    assert finding.facts["trend"] == ", rising by 40 % over the epochs"
    assert finding.facts["low"] == pytest.approx(1.41, abs=0.01)
    assert len(finding.epochs) == 10


def test_what_bends_the_inertia_as_much_bends_least_squares():
    pushed = fits(TRUTH * (1 + np.outer([-0.2, 0.2, -0.1, 0.1, 0.0, 0.2], [1.5, 1, 1])))
    assert between_epochs(pushed, False, SETTINGS) is None
    assert between_epochs(pushed, True, SETTINGS) is not None
    stiffer = fits(TRUTH * (1 + np.outer([-0.2, 0.2, -0.1, 0.1, 0.0, 0.2], [0, 0, 1])))
    assert between_epochs(stiffer, False, SETTINGS) is not None


def test_two_epochs_or_one_without_errors_say_nothing():
    two = fits(TRUTH * np.array([[1, 1, 0.5], [1, 1, 1.5]]))
    assert between_epochs(two, True, SETTINGS) is None
    without = [replace(two[0], se=np.zeros(3))] * 3
    assert between_epochs(without, True, SETTINGS) is None
