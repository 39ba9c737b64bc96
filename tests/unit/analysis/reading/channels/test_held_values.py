"""Columns whose rows are repeats of a slower sensor, or have lost samples between them."""

import numpy as np
import pytest
from scipy import signal
from tests.known_joint import TRUTH, angle_rad, torque_nm

from rigidimeter.analysis.estimation import fit_epoch
from rigidimeter.analysis.reading.channels.channels_of_table import channels_of_table
from rigidimeter.analysis.reading.channels.held_values import held_rows, knots
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import load_settings

TIME_S = np.arange(20000) / 1000.0
TORQUE_NM = torque_nm(TIME_S)


def held(values, count, first=0):
    rows = np.maximum((np.arange(values.size) - first) // count * count + first, 0)
    return values[rows]


@pytest.mark.parametrize("first", [0, 3])
def test_a_slower_angle_that_is_repeated_gives_the_joint(first):
    angle = held(angle_rad(TIME_S), 10, first)
    table = Table("r.csv", {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle_rad": angle})
    epochs, notices = epochs_from_table(table, ReadOptions())
    assert "holds each value for 10 rows" in notices[0].text
    fit = fit_epoch(epochs[0], "bandlimited", load_settings(None))
    np.testing.assert_allclose(fit.value, TRUTH, rtol=5e-3)


def test_a_torque_that_is_repeated_is_a_warning():
    columns = {"time_s": TIME_S, "torque_nm": held(TORQUE_NM, 10), "angle_rad": angle_rad(TIME_S)}
    read = channels_of_table(Table("r.csv", columns), ReadOptions())
    np.testing.assert_array_equal(read.values["torque_nm"], columns["torque_nm"])
    assert "leave the repeats blank" in read.notices[0].text


@pytest.mark.parametrize("digits", [15, 6])
def test_an_angle_that_was_interpolated_by_lines_gives_the_joint(digits):
    angle = np.interp(TIME_S, TIME_S[::10], angle_rad(TIME_S[::10]).round(digits)).round(digits)
    table = Table("r.csv", {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle_rad": angle})
    epochs, notices = epochs_from_table(table, ReadOptions())
    assert "straight lines of 10 rows" in notices[0].text
    fit = fit_epoch(epochs[0], "bandlimited", load_settings(None))
    np.testing.assert_allclose(fit.value, TRUTH, rtol=5e-3)


@pytest.mark.parametrize("ramps", [False, True])
def test_steps_and_ramps_of_the_motion_are_no_slower_sensor(ramps):
    to_and_fro = np.abs(np.arange(20000) % 1000 - 500) / 500.0
    angle = 0.2 * to_and_fro if ramps else 0.05 * (to_and_fro > 0.5)
    columns = {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle_rad": angle}
    read = channels_of_table(Table("r.csv", columns), ReadOptions())
    np.testing.assert_array_equal(read.values["angle_rad"], angle)
    assert not any("slower sensor" in notice.text for notice in read.notices)


@pytest.mark.parametrize("count", [5, 10, 50])
def test_a_simulated_velocity_that_bends_with_the_perturbation_is_no_slower_sensor(count):
    sequence = np.resize(2.0 * signal.max_len_seq(8)[0] - 1.0, 20000 // count)
    decay = np.exp(-1.0 / 67.0)  # a velocity without noise under steps of torque
    velocity = signal.lfilter([0.0, 1.0 - decay], [1.0, -decay], np.repeat(sequence, count))
    assert knots(velocity).size == 0
    assert held_rows(velocity).size == 0


@pytest.mark.parametrize("found", [held_rows, knots])
def test_an_encoder_at_rest_or_coarse_is_not_a_slower_sensor(found):
    angle = angle_rad(TIME_S)
    noisy = angle + 1e-5 * np.random.default_rng(1).normal(size=angle.size)
    coarse = np.round(angle / 0.002) * 0.002
    for values in (angle, noisy, coarse, np.zeros(1000), np.repeat([0.0, 0.1], 5000)):
        assert found(values).size == 0


@pytest.mark.parametrize("name", ["Sample", "PacketCounter", "Frame #"])
def test_samples_that_are_lost_are_a_gap_by_their_numbers(name):
    kept = np.r_[0:4000, 7000:20000]
    columns = {name: kept.astype(float), "torque_nm": TORQUE_NM[kept],
               "angle_rad": angle_rad(TIME_S)[kept]}  # fmt: skip
    read = channels_of_table(Table("r.csv", columns), ReadOptions(rate_hz=1000.0))
    np.testing.assert_allclose(read.time_s, TIME_S[kept], atol=1e-12)


def sampled(numbers, kept=slice(None)):
    columns = {"Sample": numbers.astype(float), "torque_nm": TORQUE_NM[kept],
               "angle_rad": angle_rad(TIME_S)[kept]}  # fmt: skip
    return Table("r.csv", columns, {"fs": 1000.0})


def test_a_counter_of_a_device_begins_anew():
    kept = np.r_[0:4000, 4100:20000]
    read = channels_of_table(sampled(kept % 256, kept), ReadOptions())
    np.testing.assert_allclose(read.time_s, TIME_S[kept], atol=1e-12)


def test_numbers_that_begin_anew_with_trials_are_no_clock():
    read = channels_of_table(sampled(np.arange(20000) % 5000), ReadOptions())
    np.testing.assert_allclose(read.time_s, TIME_S, atol=1e-12)


def test_numbers_that_skip_evenly_leave_the_rate_in_doubt():
    table = sampled(5 * np.arange(20000))
    with pytest.raises(UserError, match="goes up by 5 from row to row"):
        channels_of_table(table, ReadOptions())
    read = channels_of_table(table, ReadOptions(rate_hz=1000.0))
    np.testing.assert_allclose(read.time_s, TIME_S, atol=1e-12)
