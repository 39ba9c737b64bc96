"""Components of variance: recovered from drawn days, and unknown where they cannot be."""

import math

import numpy as np
import pytest

from rigidimeter.analysis.statistics import day_components


def _drawn(rng, days, counts, sd_day, sd_one, sd_epoch, both=None):
    alike = sd_day * rng.standard_normal(days)
    found = {}
    for day in range(days):
        found[f"{day}"] = tuple(
            list(
                k + alike[day] + sd_one * rng.standard_normal() + sd_epoch * rng.standard_normal(n)
            )
            if k == 0 or both is None or day < both
            else []
            for k, n in enumerate(counts)
        )
    return found


@pytest.mark.parametrize("counts", [(4, 4), (2, 6)])
@pytest.mark.parametrize("both", [None, 300])
def test_the_components_are_those_that_were_drawn(counts, both):
    epochs = {
        subject: _drawn(np.random.default_rng(seed), 600, counts, 2.0, 1.0, 3.0, both)
        for seed, subject in enumerate(("A", "B"))
    }
    found = day_components(epochs)
    assert found.within == pytest.approx(9.0, rel=0.05)
    assert found.between_days == pytest.approx(2.0**2 + 1.0**2, rel=0.1)
    assert found.condition_in_day == pytest.approx(1.0, rel=0.35)
    assert found.days_both == 2 * (both or 600)
    assert found.day_share == found.between_days / (found.between_days + found.within)


def test_a_day_that_moves_both_alike_leaves_nothing_of_one_condition():
    """Without epochs' scatter the differences of the days are equal."""
    found = day_components({"": _drawn(np.random.default_rng(1), 5, (2, 3), 2.0, 0.0, 0.0)})
    assert found.condition_in_day == pytest.approx(0.0, abs=1e-12)
    assert found.within == pytest.approx(0.0, abs=1e-12)
    assert found.between_days > 0.5


def test_what_one_day_or_one_epoch_cannot_tell_is_unknown():
    one_day = day_components({"": {"1": ([1.0, 2.0], [3.0, 4.0])}})
    assert math.isnan(one_day.between_days)
    assert math.isnan(one_day.condition_in_day)
    assert one_day.within == 0.5
    one_epoch = day_components({"": {"1": ([1.0], [2.0]), "2": ([3.0], [2.0])}})
    assert math.isnan(one_epoch.within)
    assert math.isnan(one_epoch.between_days)
    apart = day_components({"": {"1": ([1.0, 2.0], []), "2": ([3.0, 4.0], []), "3": ([], [1.0])}})
    assert math.isnan(apart.condition_in_day)
    assert apart.days_both == 0
    assert apart.between_days > 0
