"""The live estimate from rows of the ring: anew for each epoch, rests left out."""

import numpy as np
import pytest

from rigidimeter.core.settings import OnlineSettings
from rigidimeter.rig.acquisition.processes import ROW, Estimator

RATE_HZ = 1000.0
J, B = 0.0045, 0.137


def rows(epoch, first, count, stiffness_nm_rad, seed=1):
    """Return samples of a joint that is moved, with the torque that its dynamics need."""
    time_s = (first + np.arange(count)) / RATE_HZ
    rng = np.random.default_rng(seed)
    angle, velocity, torque = np.zeros((3, count))
    for omega in 2 * np.pi * np.arange(0.5, 8.0, 0.7):
        phase = rng.uniform(0, 2 * np.pi)
        wave = 0.02 * np.exp(1j * (omega * time_s + phase))
        angle += wave.imag
        velocity += (1j * omega * wave).imag
        torque += ((-J * omega**2 + 1j * omega * B + stiffness_nm_rad) * wave).imag
    made = np.zeros(count, ROW)
    made["tick"], made["time_s"], made["epoch"] = first + np.arange(count), time_s, epoch
    made["angle_rad"], made["velocity_rad_s"], made["torque_nm"] = angle, velocity, torque
    return made


def test_each_epoch_is_estimated_for_itself():
    estimator = Estimator(OnlineSettings(), RATE_HZ)
    found = estimator.take(rows(1, 0, 15_000, 1.7), 0)
    assert (found.epoch, found.since_s, found.time_s) == (1, 0.0, 14.999)
    assert found.stiffness_nm_rad == pytest.approx(1.7, rel=0.02)
    # A rest, then an epoch with twice the stiffness, in one piece.
    both = np.concatenate((rows(-1, 15_000, 5_000, 1.7), rows(2, 20_000, 15_000, 3.4)))
    found = estimator.take(both, 0)
    assert (found.epoch, found.since_s, found.tick) == (2, 20.0, 34_999)
    assert found.stiffness_nm_rad == pytest.approx(3.4, rel=0.02)
    alone = Estimator(OnlineSettings(), RATE_HZ).take(rows(2, 20_000, 15_000, 3.4), 0)
    assert found == alone


def test_ticks_that_were_left_out_do_not_make_the_motion_faster():
    """Every tenth and the two after it are missing; passed over, J would be 30 % low."""
    whole = rows(1, 0, 12_000, 1.7)
    late = whole[whole["tick"] % 10 > 2]
    estimator = Estimator(OnlineSettings(), RATE_HZ)
    for part in np.array_split(late, 97):
        found = estimator.take(part, 0)
    assert found.stiffness_nm_rad == pytest.approx(1.7, rel=0.01)
    assert found.damping_nm_s_rad == pytest.approx(B, rel=0.01)
    assert found.inertia_kg_m2 == pytest.approx(J, rel=0.01)


def test_in_parts_it_is_the_same():
    whole = rows(1, 0, 8_000, 1.7)
    estimator = Estimator(OnlineSettings(), RATE_HZ)
    for part in np.array_split(whole, 13):
        found = estimator.take(part, 0)
    once = Estimator(OnlineSettings(), RATE_HZ).take(whole, 0)
    assert found[:-1] == once[:-1]
    assert found.step_nm == pytest.approx(once.step_nm, rel=1e-12)


def test_a_rest_changes_nothing():
    estimator = Estimator(OnlineSettings(), RATE_HZ)
    found = estimator.take(rows(1, 0, 8_000, 1.7), 0)
    assert estimator.take(rows(-1, 8_000, 4_000, 9.0), 0) == found


def test_after_a_gap_it_begins_anew_and_counts_what_it_missed():
    estimator = Estimator(OnlineSettings(), RATE_HZ)
    estimator.take(rows(1, 0, 3_000, 1.7), 0)
    found = estimator.take(rows(1, 5_000, 1_000, 1.7), 2_000)
    assert (found.missed_samples, found.since_s, found.epoch) == (2_000, 5.0, 1)
    assert found.memory_s < 1.0


def test_the_change_from_tick_to_tick_is_noise_and_leaves_out_gaps():
    """White noise of s: two ticks differ by s √2. A joint that jumps in a gap changes nothing."""
    made = rows(1, 0, 20_000, 1.7)
    still = Estimator(OnlineSettings(), RATE_HZ).take(made, 0).step_nm
    made["torque_nm"] += 0.5 * np.random.default_rng(1).standard_normal(made.size)
    made["torque_nm"][made["tick"] > 10_000] += 100.0
    found = Estimator(OnlineSettings(), RATE_HZ).take(made[made["tick"] != 10_000], 0)
    assert found.step_nm == pytest.approx(np.hypot(0.5 * np.sqrt(2), still), rel=0.02)
    assert still < 0.02
