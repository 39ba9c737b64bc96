import math

import numpy as np
import pytest

from rigidimeter.estimation.tracking_quality import tracking

T = np.arange(0.0, 40.0, 0.01)


def test_an_exponential_rises_in_tau_ln_9():
    truth = np.where(T < 10.0, 1.0, 3.0)
    estimate = np.where(T < 10.0, 1.0, 3.0 - 2.0 * np.exp(-(T - 10.0) / 2.0))
    assert tracking(T, estimate, truth).rise_time_s == pytest.approx(2 * math.log(9), abs=0.02)


def test_a_step_down_rises_too():
    truth = np.where(T < 10.0, 3.0, 1.0)
    estimate = np.where(T < 10.0, 3.0, 1.0 + 2.0 * np.exp(-(T - 10.0) / 2.0))
    assert tracking(T, estimate, truth).rise_time_s == pytest.approx(2 * math.log(9), abs=0.02)


def test_bias_and_random_error_are_mean_and_sd():
    truth = np.sin(T)
    error = np.tile([0.5, 0.3], T.size // 2)
    found = tracking(T, truth + error, truth)
    assert found.bias == pytest.approx(0.4)
    assert found.random_error == pytest.approx(0.1)
    assert found.vaf_percent == pytest.approx(100 * (1 - 0.01 / np.var(truth)))
    assert math.isnan(found.rise_time_s)


def test_what_does_not_change_has_no_vaf_and_what_never_arrives_no_rise_time():
    assert math.isnan(tracking(T, np.ones(T.size), np.full(T.size, 2.0)).vaf_percent)
    truth = np.where(T < 10.0, 1.0, 3.0)
    assert math.isnan(tracking(T, np.ones(T.size), truth).rise_time_s)
