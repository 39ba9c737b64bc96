"""Which model is recommended, for torques whose terms are known."""

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import Signals
from rigidimeter.analysis.estimation.terms import candidates, compare_models
from rigidimeter.analysis.estimation.terms.beyond_linear import beyond_linear
from rigidimeter.analysis.estimation.terms.held_out import block_errors, blocks, gain

RATE_HZ = 500.0
BAND_HZ = (0.0, 20.0)
JBK = "inertia,damping,stiffness"


def smooth(rng, n, low_hz, high_hz):
    """Gaussian noise in a band, SD 1."""
    frequency_hz = np.fft.rfftfreq(n, 1 / RATE_HZ)
    inside = (frequency_hz >= low_hz) & (frequency_hz <= high_hz)
    lines = np.zeros(frequency_hz.size, complex)
    lines[inside] = rng.standard_normal(inside.sum()) + 1j * rng.standard_normal(inside.sum())
    values = np.fft.irfft(lines, n)
    return values / values.std()


def moved(seed, push_nm=0.0, duration_s=20.0):
    """A joint of J, B and K that is moved by noise, and by its own push through a filter.

    The push is in the torque with a minus, as in a closed loop; it reaches the velocity 60 ms
    late, so that a delayed velocity predicts it.
    """
    rng = np.random.default_rng(seed)
    n = round(duration_s * RATE_HZ)
    push = push_nm * smooth(rng, n, 0.3, 4.0)
    late = np.roll(push, round(0.06 * RATE_HZ))
    omega = 2j * np.pi * np.fft.rfftfreq(n, 1 / RATE_HZ)
    velocity = np.fft.rfft(0.2 * smooth(rng, n, 0.3, 8.0) + 0.5 * late)
    whole = [np.fft.irfft(velocity * omega, n), np.fft.irfft(velocity, n)]
    angle = np.divide(velocity, omega, out=np.zeros_like(velocity), where=omega != 0)
    a, v, x = *whole, np.fft.irfft(angle, n)
    torque = 0.01 * a + 0.2 * v + 3 * x - push + 0.005 * rng.standard_normal(n)
    return Signals(np.arange(n) / RATE_HZ, torque, a, v, x, RATE_HZ, (0.0, RATE_HZ / 2))


def with_more(motion, more_nm):
    return replace(motion, torque_nm=motion.torque_nm + more_nm)


EXTRA = {
    "reflex+": lambda m: 0.1 * np.maximum(np.roll(m.velocity_rad_s, 30), 0),
    "reflex-": lambda m: 0.1 * np.minimum(np.roll(m.velocity_rad_s, 30), 0),
    "coulomb": lambda m: 0.05 * np.sign(m.velocity_rad_s),
    "cubic": lambda m: 300.0 * m.angle_rad**3,
}


class TestBeyondLinear:
    @pytest.mark.parametrize("push_nm", [0.0, 0.3])
    @pytest.mark.parametrize("name", list(EXTRA))
    def test_a_term_has_its_gain_though_the_loop_carries_the_push(self, name, push_nm):
        motion = moved(1, push_nm)
        beyond = beyond_linear(with_more(motion, EXTRA[name](motion)), BAND_HZ)
        found = beyond.solve(beyond.columns([name], [0.06] if "reflex" in name else []))
        truth = {"coulomb": 0.05, "cubic": 300.0}.get(name, 0.1)
        assert found.values[0] == pytest.approx(truth, rel=0.1)
        assert abs(found.values[0] - truth) < 4 * np.sqrt(found.covariance[0, 0]) + 0.02 * truth

    def test_a_term_that_is_not_there_has_none(self):
        scores = []
        for seed in range(12):
            beyond = beyond_linear(moved(seed, 0.3), BAND_HZ)
            for name, inner in (("coulomb", []), ("cubic", []), ("reflex+", [0.06])):
                found = beyond.solve(beyond.columns([name], inner))
                scores.append(found.values[0] / np.sqrt(found.covariance[0, 0]))
        assert np.mean(np.abs(scores) > 1.96) <= 0.15
        assert np.std(scores) == pytest.approx(1.0, abs=0.3)

    def test_j_b_and_k_are_linear_and_a_series_has_the_sum_of_its_lines(self):
        motion = moved(2)
        beyond = beyond_linear(motion, BAND_HZ)
        names = ("inertia", "damping", "stiffness", "coulomb", "reflex+")
        assert beyond.not_linear(names) == ("coulomb", "reflex+")
        whole = np.sum(beyond.series(beyond.torque) ** 2)
        assert whole == pytest.approx(np.sum(np.abs(beyond.torque) ** 2), rel=0.1)

    def test_too_few_lines_and_an_exact_torque_are_refused(self):
        motion = moved(3)
        with pytest.raises(ValueError, match=r"spectral lines from 0\.15 to 0\.3 Hz; at least"):
            beyond_linear(motion, (0.15, 0.3))
        exact = replace(motion, torque_nm=2.0 * motion.velocity_rad_s)
        with pytest.raises(ValueError, match="to the last digit"):
            beyond_linear(exact, (0.3, 8.0))


class TestHeldOut:
    def test_every_sample_is_in_one_block_and_no_fit_sees_it_or_its_neighbours(self):
        found = np.zeros(1000)
        for block, seen in blocks(1000, 50.0, 0.4):
            found[block] += 1
            assert not seen[max(block.start - 20, 0) : block.stop + 20].any()
            assert seen.sum() >= 1000 - (block.stop - block.start) - 40
        assert np.all(found == 1)

    def test_a_prediction_is_of_what_was_not_seen(self):
        """One block differs: fitted to the others alone, its error is the whole difference."""
        column = np.ones((800, 1))
        target = np.ones(800)
        target[:100] = 3.0
        errors = block_errors(target, [column], 100.0, 0.0)
        assert errors[0] == pytest.approx(100 * 4.0)
        assert errors[1:] == pytest.approx(np.full(7, 100 * (2 / 7) ** 2))

    def test_a_gain_is_what_is_left_of_the_error_with_its_interval(self):
        smaller, larger = np.array([4.0, 4.0, 4.0, 4.0]), np.array([3.0, 2.0, 2.0, 1.0])
        found = gain(smaller, larger)
        assert found.percent == pytest.approx(50.0)
        # Without each block in turn 5, 6, 6 and 7 of 12 are left; Student's t, 3 degrees: 3.182.
        left = np.log(np.array([5, 6, 6, 7]) / 12)
        half = 3.1824 * np.sqrt(3 / 4 * np.sum((left - left.mean()) ** 2))
        assert found.low_percent == pytest.approx(100 - 50 * np.exp(half), rel=1e-3)
        assert found.high_percent == pytest.approx(100 - 50 * np.exp(-half), rel=1e-3)
        assert gain(smaller, larger, 5).low_percent < found.low_percent

    def test_no_gain_passes_100_percent(self):
        """Blocks of very different size: their mean difference would have a wide interval."""
        smaller = np.array([900.0, 2.0, 1.0, 30.0, 5.0, 2.0, 400.0, 1.0])
        found = gain(smaller, 5e-4 * smaller)
        assert found == pytest.approx((99.95, 99.95, 99.95))
        assert gain(smaller, np.zeros(8)).high_percent <= 100


class TestRecommended:
    def test_j_b_and_k_are_enough_where_nothing_else_is(self):
        terms = f"{JBK},reflex,cubic,directional-damping,coulomb"
        compared = compare_models(moved(4, 0.2), candidates(terms), BAND_HZ, grow=True)
        assert compared.recommended is compared.rows[0]
        assert "inertia+damping+stiffness: predicts" in compared.reason

    @pytest.mark.parametrize("name", list(EXTRA))
    def test_a_term_that_is_there_is_recommended(self, name):
        motion = moved(5, 0.2)
        motion = with_more(motion, EXTRA[name](motion))
        compared = compare_models(
            motion, candidates(f"{JBK},reflex,cubic,coulomb"), BAND_HZ, grow=True
        )
        assert compared.recommended is not None
        assert compared.recommended.terms[3:] == (name,)
        assert "beyond any linear loop" in compared.reason

    def test_two_terms_are_found_one_after_the_other(self):
        motion = moved(6)
        more = EXTRA["coulomb"](motion) + EXTRA["cubic"](motion)
        compared = compare_models(
            with_more(motion, more), candidates(f"{JBK},cubic,coulomb"), BAND_HZ, grow=True
        )
        assert compared.recommended is not None
        assert set(compared.recommended.terms[3:]) == {"cubic", "coulomb"}

    def test_a_friction_that_pushes_is_not_chosen(self):
        motion = moved(7)
        motion = with_more(motion, -0.05 * np.sign(motion.velocity_rad_s))
        compared = compare_models(motion, candidates(f"{JBK},coulomb"), BAND_HZ)
        assert compared.recommended is compared.rows[0]
        assert "it pushes, and a friction resists" in compared.rows[1].problem
        alone = compare_models(motion, [f"{JBK},coulomb".split(",")], BAND_HZ)
        assert alone.recommended is None
        assert "none of these models explains this torque: the gain of coulomb" in alone.reason

    def test_a_torque_that_has_nothing_to_do_with_the_motion_has_no_model(self):
        motion = moved(8)
        noise = smooth(np.random.default_rng(80), motion.torque_nm.size, 0.3, 8.0)
        compared = compare_models(replace(motion, torque_nm=noise), candidates(JBK), BAND_HZ)
        assert compared.recommended is None
        assert "none of these models explains this torque: the best" in compared.reason

    def test_the_inertia_is_needed(self):
        compared = compare_models(
            moved(9), [["damping", "stiffness"], ["inertia", "damping", "stiffness"]], BAND_HZ
        )
        assert compared.recommended is compared.rows[1]
        assert "of what damping+stiffness leaves" in compared.reason
