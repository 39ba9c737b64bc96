"""The time of a sample by the sensor's own counter: closed forms."""

from __future__ import annotations

import math
import random

import pytest

from rigidimeter.rig.devices import LONGEST_DELAY_S, SampleClock

RATE_HZ = 1000.0
DRIFT = 700e-6


def ages_s(arrivals_s, steps=None):
    """Return by how much each of the arrivals is taken to be older than it came."""
    clock = SampleClock(DRIFT)
    clock.restart(RATE_HZ)
    steps = steps or [1] * len(arrivals_s)
    return [t - clock.taken_s(t, k) for t, k in zip(arrivals_s, steps, strict=True)]


def test_a_delay_that_grows_is_found_but_for_the_drift():
    """Delay g·t is an age of (g − d)·t."""
    growth = 0.3
    arrivals_s = [0.001 * k * (1.0 + growth) for k in range(2000)]
    found_s = ages_s(arrivals_s)
    passed_s = arrivals_s[-1]
    expected_s = passed_s - passed_s / (1.0 + growth) - DRIFT * passed_s
    assert found_s[-1] == pytest.approx(expected_s, rel=1e-9)


@pytest.mark.parametrize("ppm", [-700, -200, 0, 200, 690])
def test_clocks_that_part_no_faster_than_allowed_make_nothing_old(ppm):
    """An hour at 700 ppm is 2.5 s."""
    ticks = range(0, 3_600_000, 20)
    arrivals_s = [0.001 * k * (1.0 + 1e-6 * ppm) for k in ticks]
    assert max(ages_s(arrivals_s, [20] * len(ticks))) < 1e-6


def test_a_delay_that_grows_more_slowly_than_the_clocks_may_part_is_not_seen():
    arrivals_s = [0.001 * k * (1.0 + 0.9 * DRIFT) for k in range(0, 1_000_000, 100)]
    assert max(ages_s(arrivals_s, [100] * len(arrivals_s))) < 1e-6


def test_jitter_is_the_age_of_what_came_late_and_of_nothing_else():
    rng = random.Random(1)
    jitter_s = [rng.uniform(0.0, 0.005) for _ in range(5000)]
    arrivals_s = [0.001 * k + late_s for k, late_s in enumerate(jitter_s)]
    found_s = ages_s(arrivals_s)
    # Once the fastest were seen, m is right to within their wait for one another.
    for late_s, age_s in list(zip(jitter_s, found_s, strict=True))[1000:]:
        assert age_s == pytest.approx(late_s, abs=5e-4)
    assert min(found_s) >= 0.0


def test_a_burst_after_a_pause_ends_with_a_fresh_sample():
    """0.2 s of samples arrive at once: each is as old as its number says."""
    arrivals_s = [0.001 * k for k in range(100)] + [0.3] * 200 + [0.301]
    found_s = ages_s(arrivals_s)
    assert found_s[100] == pytest.approx(0.2 - DRIFT * 0.201, abs=1e-9)
    assert found_s[299:] == pytest.approx([0.001, 0.001], abs=2e-4)


def test_samples_that_are_lost_make_none_old():
    assert ages_s([0.0, 0.001, 0.011, 0.012], [1, 1, 10, 1]) == pytest.approx([0.0] * 4, abs=1e-9)


def test_of_an_unknown_rate_a_sample_is_as_old_as_its_arrival():
    clock = SampleClock(DRIFT)
    assert [clock.taken_s(t, 1) for t in (1.0, 5.0)] == [1.0, 5.0]
    clock.restart(math.nan)
    assert clock.taken_s(7.0, 1) == 7.0


@pytest.mark.parametrize("rate", [1.3, 7.0])
def test_a_counter_that_gains_on_the_clock_bears_times_to_come(rate):
    """It gains rate - 1 s a second; the first sample may have been late by 0.1 s of it."""
    arrivals_s = [0.001 * k / rate for k in range(2000)]
    found_s = ages_s(arrivals_s)
    passed_s = arrivals_s[-1]
    ahead_s = (rate - 1.0) * passed_s - LONGEST_DELAY_S - DRIFT * passed_s
    assert found_s[-1] == pytest.approx(-ahead_s, rel=1e-6)
    assert max(found_s) < 1e-9


def test_a_first_sample_that_was_late_makes_no_other_early():
    assert ages_s([0.099, *(0.001 * k for k in range(1, 100))])[1:] == pytest.approx([0.0] * 99)
