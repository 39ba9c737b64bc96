"""The error of two clocks' offset in J, B and K, against its closed form."""

from dataclasses import replace

import numpy as np
import pytest
from tests.known_joint import DAMPING_NM_S_RAD, INERTIA_KG_M2, STIFFNESS_NM_RAD, TRUTH

from rigidimeter.analysis.estimation import estimate_recorded, prepare
from rigidimeter.core.records import Channel, Delay, Epoch
from rigidimeter.core.settings import Settings

ERROR_S = 1e-3
OMEGA = 2 * np.pi * np.array([1.0, 1.5, 2.0])
TIME_S = np.arange(4000) / 200.0


def epoch(
    clock_error_s: float = 0.0,
    label: str = "1",
    seed: int = 0,
    source: str = "r",
    noise_nm: float = 1e-3,
) -> Epoch:
    """Return three lines of 0.1 rad, and the torque with noise.

    Much noise weights lines alike whether the torque is late or not, as a closed form has it, to
    the scatter of its power over few lines.
    """
    angle, velocity, acceleration = (
        0.1 * np.sum(OMEGA[:, None] ** n * np.cos(np.outer(OMEGA, TIME_S) + n * np.pi / 2), axis=0)
        for n in range(3)
    )
    torque = (
        INERTIA_KG_M2 * acceleration + DAMPING_NM_S_RAD * velocity + STIFFNESS_NM_RAD * angle
    ) + noise_nm * np.random.default_rng(seed).normal(size=TIME_S.size)
    channels = {
        name: Channel(name, TIME_S, values)
        for name, values in (("torque_nm", torque), ("angle_rad", angle))
    }
    return Epoch(source, label, channels, task="prbs", clock_error_s=clock_error_s)


def analysed(epochs, *delays):
    recorded = prepare(epochs, Settings(), clocks=False)._replace(delays=delays)
    return estimate_recorded(recorded, "bandlimited")


def with_and_without(epochs, *delays):
    """Return analyses of epochs as they are, and as if their clocks were known exactly."""
    exact = [replace(one, clock_error_s=0.0) for one in epochs]
    known = [replace(one, delay_s_se=0.0) for one in delays]
    return analysed(exact, *known), analysed(epochs, *delays)


def late(epoch, by_s):
    torque = epoch.channels["torque_nm"]
    moved = Channel(torque.name, torque.time_s + by_s, torque.values)
    return replace(epoch, channels={**epoch.channels, torque.name: moved})


def test_what_is_added_is_the_closed_form():
    """dJ = −B δ, dK = 0, dB = −K δ + J δ ⟨ω²⟩, the mean weighted by the power of the velocity."""
    plain, wide = (one.fits[0] for one in with_and_without([epoch(ERROR_S, noise_nm=0.3)]))
    mean = np.sum(OMEGA**4) / np.sum(OMEGA**2)
    added = ERROR_S * np.array([DAMPING_NM_S_RAD, STIFFNESS_NM_RAD - INERTIA_KG_M2 * mean, 0.0])
    found = np.sqrt(np.diag(wide.covariance - plain.covariance))
    np.testing.assert_allclose(found[:2], np.abs(added[:2]), rtol=0.1)
    assert found[2] < 1e-3 * STIFFNESS_NM_RAD
    np.testing.assert_allclose(wide.se, np.hypot(plain.se, found), rtol=1e-9)
    np.testing.assert_array_equal(wide.value, plain.value)


def test_the_interval_holds_the_truth_of_a_torque_that_is_late_by_its_error():
    plain, wide = (one.fits[0] for one in with_and_without([late(epoch(ERROR_S), ERROR_S)]))
    assert not np.all((plain.low <= TRUTH)[:2] & (plain.high >= TRUTH)[:2])
    assert np.all((wide.low <= TRUTH)[:2] & (wide.high >= TRUTH)[:2])


def test_it_does_not_become_smaller_by_pooling():
    plain, wide = with_and_without([epoch(ERROR_S, str(k), k) for k in range(4)])
    added = np.sqrt(np.diag(wide.pooled[0].covariance - plain.pooled[0].covariance))[:2]
    alone = np.sqrt(np.diag(wide.fits[0].covariance))[:2]
    np.testing.assert_allclose(added, alone, rtol=0.05)


def test_independent_errors_of_two_sources_become_smaller_by_pooling():
    """Of two equal ones by √2: their mean is pooled."""
    plain, wide = with_and_without(
        [epoch(ERROR_S, "1", k, source, 0.3) for k, source in enumerate("ab")]
    )
    added = np.sqrt(np.diag(wide.pooled[0].covariance - plain.pooled[0].covariance))[:2]
    alone = np.sqrt(np.diag(wide.fits[0].covariance - plain.fits[0].covariance))[:2]
    np.testing.assert_allclose(added, alone / np.sqrt(2), rtol=0.2)


@pytest.mark.parametrize("clock_error_s", [0.0, ERROR_S])
def test_of_a_corrected_delay_its_own_error_counts(clock_error_s):
    """Whether torque and motion had two clocks or one; and up to half a tick may be the drive's."""
    half_tick_s = 0.5 / Settings().rig.tick_rate_hz
    delay = Delay("r", 0.01, ERROR_S / 10, corrected=True)
    plain = analysed([epoch()]).fits[0]
    wide = analysed([late(epoch(clock_error_s), 0.01)], delay).fits[0]
    added = np.sqrt((wide.covariance - plain.covariance)[0, 0])
    late_s = np.hypot(0.1 * ERROR_S, half_tick_s / np.sqrt(3))
    assert added == pytest.approx(late_s * DAMPING_NM_S_RAD, rel=0.05)


@pytest.mark.parametrize(("delay_s", "its"), [(0.0004, True), (0.0008, False), (-0.0004, False)])
def test_a_delay_within_half_a_tick_that_was_not_corrected_may_be_the_drives(delay_s, its):
    """Or the torque's, by as much of it as not; a longer one is neither, and has its finding."""
    delay = Delay("r", delay_s, 1e-5)
    plain, wide = (analysed([epoch()], *own).fits[0] for own in ((), (delay,)))
    offset = analysed([epoch(abs(delay_s) / np.sqrt(3))]).fits[0]
    np.testing.assert_allclose(wide.se, offset.se if its else plain.se, rtol=1e-9)
    assert offset.se[0] > 5 * plain.se[0]


def test_estimate_contains_it_in_both_stages():
    plain, wide = with_and_without([epoch(ERROR_S)])
    for stage in ("fits", "fixed_inertia"):
        (a,), (b,) = getattr(plain, stage), getattr(wide, stage)
        assert b.se[1] > 5 * a.se[1]
    assert wide.fixed_inertia[0].se[0] == 0.0
