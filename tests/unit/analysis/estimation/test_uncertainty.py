"""Intervals against closed forms, against another program, and by how often they hold."""

import numpy as np
import pytest
from scipy import signal

from rigidimeter.analysis.estimation.uncertainty import (
    correlation_samples,
    cramer_rao_coloured,
    hac_covariance,
    of_fit,
)

JOINT = np.array([0.0045, 0.1368, 1.751])
RATE_HZ, N = 100.0, 2000


def motion(rng, n=N, rate_hz=RATE_HZ):
    """Acceleration, velocity and angle of the paper's loop under random binary torque, in band."""
    chips = np.repeat(rng.choice([-1.0, 1.0], n // 5 + 1), round(rate_hz / 20))[:n]
    J, B, K = np.array([0.0458, 1.604, 0.0]) + JOINT
    loop = signal.cont2discrete(([1.0], [J, B, K]), 1 / rate_hz)
    x = signal.lfilter(loop[0].ravel(), loop[1], chips)
    loop = signal.cont2discrete(([1.0, 0.0], [J, B, K]), 1 / rate_hz)
    v = signal.lfilter(loop[0].ravel(), loop[1], chips)
    a = (chips - B * v - K * x) / J
    band = signal.butter(2, [0.15, 10.0], "bandpass", fs=rate_hz, output="sos")
    return signal.sosfiltfilt(band, np.column_stack([a, v, x]), axis=0)


def first_order(rng, n=N):
    return signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal(n + 500))[500:]


def voluntary(rng, n=N, rate_hz=RATE_HZ):
    band = signal.butter(2, [0.3, 4.0], "bandpass", fs=rate_hz, output="sos")
    return signal.sosfilt(band, rng.standard_normal(n + 3000))[3000:]


def white(rng, n=N):
    return rng.standard_normal(n)


def fitted(A, e):
    """Return (AᵀA)⁻¹, the error of the estimate, and the scores."""
    bread = np.linalg.inv(A.T @ A)
    error = bread @ (A.T @ e)
    return bread, error, A * (e - A @ error)[:, None]


def test_white_scores_have_no_correlation_and_a_moving_sum_has_its_length():
    rng = np.random.default_rng(0)
    values = rng.standard_normal((100_000, 1))
    assert correlation_samples(values)[0] == pytest.approx(1.0, abs=0.1)
    sums = np.cumsum(values, axis=0)
    assert correlation_samples(sums[20:] - sums[:-20])[0] == pytest.approx(20.0, rel=0.15)


def test_the_sampling_rate_does_not_change_the_answer():
    rng = np.random.default_rng(4)
    A, e = motion(rng), voluntary(rng)
    coarse = hac_covariance(*(fitted(A, e)[k] for k in (0, 2)))
    A10, e10 = (signal.resample(values, 10 * N, axis=0) for values in (A, e))
    fine = hac_covariance(*(fitted(A10, e10)[k] for k in (0, 2)))
    np.testing.assert_allclose(fine.standard_errors, coarse.standard_errors, rtol=0.05)
    assert fine.degrees_of_freedom == pytest.approx(coarse.degrees_of_freedom, abs=2)


def coverage(noise, seeds, covers):
    held = []
    for seed in seeds:
        rng = np.random.default_rng([11, seed])
        A = motion(rng)
        low, high = covers(A, noise(rng), rng)
        held.append((low <= 0) & (high >= 0))
    return 100 * np.mean(held, axis=0)


def interval(error, covariance, degrees):
    found = of_fit(error, covariance, degrees, np.zeros(error.size))
    return found["low"], found["high"]


def by_hac(A, e, rng):
    bread, error, scores = fitted(A, e)
    found = hac_covariance(bread, scores)
    return interval(error, found.covariance, found.degrees_of_freedom)


@pytest.mark.parametrize("noise", [white, first_order, voluntary])
def test_intervals_of_95_percent_hold(noise):
    # Measured in 3000 trials: 93 to 96 %. In 100 trials a true 93 % shows as 85 % or more, but for
    # one case in 600. The test of many trials is the sharp one.
    held = coverage(noise, range(100), by_hac)
    assert np.all(held >= 85.0), held


def test_textbook_intervals_do_not_hold():
    # So that the test above is seen to tell: σ² (AᵀA)⁻¹ takes each of 2000 samples for independent.
    def by_textbook(A, e, rng):
        bread, error, _ = fitted(A, e)
        return interval(error, bread * np.mean((e - A @ error) ** 2), e.size - 3)

    assert np.all(coverage(voluntary, range(100), by_textbook)[1:] < 75.0)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [white, first_order, voluntary])
def test_intervals_of_95_percent_hold_in_many_trials(noise):
    held = coverage(noise, range(3000), by_hac)
    print(f"hac, {noise.__name__}: {held.round(1)}")
    assert np.all((held > 92.5) & (held < 97.0)), held


def test_the_cosines_and_the_small_sample_factor_are_those_of_the_formula():
    rng = np.random.default_rng(15)
    bread, _, scores = fitted(motion(rng), voluntary(rng))
    found = hac_covariance(bread, scores)
    independent = N / np.max(correlation_samples(scores))
    assert found.degrees_of_freedom == round(0.8 * independent ** (2 / 3))
    t, j = np.arange(N), np.arange(1, round(found.degrees_of_freedom) + 1)
    sums = np.sqrt(2) * np.cos(np.pi * np.outer(j, t + 0.5) / N) @ scores
    middle = sums.T @ sums / j.size * independent / (independent - 3)
    np.testing.assert_allclose(found.covariance, bread @ middle @ bread.T, rtol=1e-9)
    np.testing.assert_allclose(found.standard_errors**2, np.diag(found.covariance), rtol=1e-12)


def test_too_few_samples_and_wrong_shapes_are_refused():
    with pytest.raises(ValueError, match="too few"):
        hac_covariance(np.eye(3), np.ones((4, 3)))
    with pytest.raises(ValueError, match="bread has shape"):
        hac_covariance(np.eye(2), np.ones((40, 3)))


@pytest.mark.parametrize("n", [2000, 2001])
def test_the_coloured_bound_of_white_noise_is_the_white_bound(n):
    A = motion(np.random.default_rng(9), n)
    density = np.full(n // 2 + 1, 2 * 0.3**2 / RATE_HZ)
    density[0] /= 2
    if n % 2 == 0:
        density[-1] /= 2
    np.testing.assert_allclose(
        cramer_rao_coloured(A, density, RATE_HZ), 0.09 * np.linalg.inv(A.T @ A), rtol=1e-7
    )


def test_a_line_that_is_left_out_informs_nobody():
    t = np.arange(N) / RATE_HZ
    x = np.sin(2 * np.pi * 1.0 * t) + np.sin(2 * np.pi * 5.0 * t)
    density = np.full(N // 2 + 1, 0.01)
    density[np.fft.rfftfreq(N, 1 / RATE_HZ) > 2.0] = np.inf
    bound = cramer_rao_coloured(x[:, None], density, RATE_HZ)
    expected = 0.01 * RATE_HZ / 2 / np.sum(np.sin(2 * np.pi * t) ** 2)
    assert bound[0, 0] == pytest.approx(expected, rel=1e-9)


def test_weighting_by_the_spectrum_beats_least_squares_and_reaches_the_bound():
    # Generalised least squares on the lines, with the true density, has the bound as its scatter.
    band = signal.butter(1, 3.0, fs=RATE_HZ, output="sos")
    frequency = np.fft.rfftfreq(N, 1 / RATE_HZ)
    gain = np.abs(signal.sosfreqz(band, frequency, fs=RATE_HZ)[1]) ** 2
    density = np.maximum(gain, 1e-6) * 2 / RATE_HZ
    density[frequency > 40.0] = np.inf
    A = motion(np.random.default_rng(10))
    weight = np.sqrt(1 / density)[:, None]
    lines = np.fft.rfft(A, axis=0) * weight
    design = np.concatenate([lines.real, lines.imag])
    errors, plain = [], []
    for seed in range(200):
        rng = np.random.default_rng([12, seed])
        e = signal.sosfilt(band, rng.standard_normal(N + 500))[500:]
        noise = np.fft.rfft(e) * weight[:, 0]
        target = np.concatenate([noise.real, noise.imag])
        errors.append(np.linalg.lstsq(design, target, rcond=None)[0])
        plain.append(fitted(A, e)[1])
    bound = np.sqrt(np.diag(cramer_rao_coloured(A, density, RATE_HZ)))
    np.testing.assert_allclose(np.std(errors, axis=0), bound, rtol=0.15)
    assert np.std(plain, axis=0)[0] > 1.15 * bound[0]
