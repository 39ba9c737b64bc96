"""Each term against a motion whose derivatives are known in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from rigidimeter.analysis.estimation import Signals
from rigidimeter.analysis.estimation.terms import (
    TERMS,
    fit_terms,
    parse_terms,
    wideband_from_angle,
)
from rigidimeter.analysis.estimation.terms.reflex import kernel, pass_through, stretch_velocity
from rigidimeter.core.errors import UserError

RATE_HZ = 500.0
BAND_HZ = (0.0, 20.0)
REGRESSORS = {term.name: term.regressor for term in TERMS}


def wide(torque, x, v, a):
    """Return signals of all frequencies."""
    return Signals(np.arange(x.size) / RATE_HZ, torque, a, v, x, RATE_HZ, (0.0, RATE_HZ / 2))


def smooth_motion(rng, duration_s=30.0, rate_hz=RATE_HZ, high_hz=8.0, late_s=0.0):
    """A sum of sinusoids, so that position, velocity and acceleration are exact."""
    t = np.arange(round(duration_s * rate_hz)) / rate_hz - late_s
    frequency_hz = np.linspace(0.2, high_hz, 60)
    phase = rng.uniform(0, 2 * np.pi, frequency_hz.size)
    w = 2 * np.pi * frequency_hz[:, None]
    angle = w * t + phase[:, None]
    scale = 0.02 / (1 + frequency_hz[:, None])
    return t, [
        (scale * np.sin(angle)).sum(0),
        (scale * w * np.cos(angle)).sum(0),
        (-scale * w**2 * np.sin(angle)).sum(0),
    ]


@pytest.fixture
def exact():
    _, (x, v, a) = smooth_motion(np.random.default_rng(3))
    return wide(np.zeros_like(x), x, v, a)


def driven(motion, torque):
    return replace(motion, torque_nm=torque)


CLOSED_FORM = {
    "inertia": lambda x, v, a: a,
    "damping": lambda x, v, a: v,
    "stiffness": lambda x, v, a: x,
    "offset": lambda x, v, a: 1.0,
    "coulomb": lambda x, v, a: (v > 0) * 1.0 - (v < 0),
    "quadratic": lambda x, v, a: x * x,
    "cubic": lambda x, v, a: x * x * x,
    "damping+": lambda x, v, a: v * (v > 0),
    "damping-": lambda x, v, a: v * (v < 0),
    "stiffness+": lambda x, v, a: x * (v > 0),
    "stiffness-": lambda x, v, a: x * (v < 0),
    "coulomb+": lambda x, v, a: (v > 0) * 1.0,
    "coulomb-": lambda x, v, a: (v < 0) * -1.0,
}


def test_every_term_has_a_closed_form_here():
    assert set(CLOSED_FORM) == set(REGRESSORS)


@pytest.mark.parametrize("name", list(REGRESSORS))
def test_a_term_is_its_closed_form_at_one_instant(name):
    for x, v, a in ((0.3, 2.0, -5.0), (-0.4, -1.5, 7.0)):
        motion = wide(*(np.array([value]) for value in (0.0, x, v, a)))
        assert REGRESSORS[name](motion)[0] == pytest.approx(CLOSED_FORM[name](x, v, a))


@pytest.mark.parametrize("name", list(REGRESSORS))
def test_a_term_is_found_beside_j_b_k(exact, name):
    base = {"inertia": 0.01, "damping": 0.2, "stiffness": 3.0}
    side = {"damping+": "damping-", "stiffness+": "stiffness-"}
    if name.rstrip("+-") in base and name[-1] in "+-":
        base.pop(name.rstrip("+-"))
        other = side.get(name, name[:-1] + "+")
        base[other] = 0.7
    truth = base | {name: 1.7}
    torque = sum(value * REGRESSORS[term](exact) for term, value in truth.items())
    fit = fit_terms(driven(exact, torque), list(truth), BAND_HZ)
    for term, value in truth.items():
        assert fit[term].value == pytest.approx(value, rel=1e-6)
    assert fit.vaf_percent == pytest.approx(100.0)


def test_derivatives_in_the_frequency_domain_are_exact_inside():
    _, (x, v, a) = smooth_motion(np.random.default_rng(1))
    motion = wideband_from_angle(x, x, RATE_HZ, 1e9)
    inner = slice(500, -500)
    np.testing.assert_allclose(motion.velocity_rad_s[inner], v[inner], atol=2e-3 * np.std(v))
    np.testing.assert_allclose(motion.acceleration_rad_s2[inner], a[inner], atol=2e-2 * np.std(a))
    np.testing.assert_allclose(motion.angle_rad, x, atol=1e-12)


def test_a_straight_line_has_a_constant_velocity_and_no_acceleration():
    line = 0.3 + 0.5 * np.arange(1000) / RATE_HZ
    motion = wideband_from_angle(line, line, RATE_HZ, 50.0)
    np.testing.assert_allclose(motion.velocity_rad_s, 0.5, atol=1e-9)
    np.testing.assert_allclose(motion.acceleration_rad_s2, 0.0, atol=1e-7)


def test_a_bent_term_is_bent_before_it_is_filtered(exact):
    """F(x³) is not F(x)³: with the band below the motion only the right order gives the truth."""
    torque = 2.0 * exact.angle_rad + 900.0 * exact.angle_rad**3
    fit = fit_terms(driven(exact, torque), "stiffness,cubic", (0.0, 3.0))
    assert fit["cubic"].value == pytest.approx(900.0, rel=1e-6)


@pytest.mark.parametrize("sign", ["+", "-"])
def test_a_reflex_passes_late_and_rectified(sign):
    """A velocity step of 2 rad/s: the pure path is the step itself, a delay later."""
    velocity = np.where(np.arange(4000) >= 2000, 2.0, -2.0)
    motion = wide(velocity, velocity, velocity, velocity)
    stretch = stretch_velocity(motion, f"reflex{sign}")
    (passed,) = pass_through(stretch, RATE_HZ, kernel("reflex"), np.array([0.3]))
    late = round(0.3 * RATE_HZ)
    np.testing.assert_allclose(passed[2000 + late + 50 : 3500], stretch[3000], atol=0.05)
    np.testing.assert_allclose(passed[1000 : 2000 + late - 50], stretch[1000], atol=0.05)
    assert stretch[3000] == (2.0 if sign == "+" else 0.0)
    assert stretch[1000] == (0.0 if sign == "+" else -2.0)


@pytest.mark.parametrize("name", ["reflex+", "reflex-second-order-"])
def test_a_known_reflex_is_recovered(exact, name):
    rng = np.random.default_rng(5)
    truth = {"delay": 0.045, "natural frequency": 2.5, "damping ratio": 0.9}
    # The late velocity is in closed form, and the muscle a discrete filter: nothing of ours.
    _, (_, late, _) = smooth_motion(np.random.default_rng(3), late_s=truth["delay"])
    reflex = np.maximum(late, 0.0) if name.endswith("+") else np.minimum(late, 0.0)
    if "second" in name:
        w = 2 * np.pi * truth["natural frequency"]
        plant = ([w**2], [1.0, 2 * truth["damping ratio"] * w, w**2])
        b, a, _ = signal.cont2discrete(plant, 1 / RATE_HZ, "foh")
        reflex = signal.lfilter(b.ravel(), a, reflex)
    torque = 0.015 * exact.acceleration_rad_s2 + 0.6 * exact.velocity_rad_s + 60.0 * exact.angle_rad
    torque = torque + 8.0 * reflex
    torque = torque + 0.05 * np.std(torque) * rng.standard_normal(torque.size)
    fit = fit_terms(driven(exact, torque), f"inertia,damping,stiffness,{name}", BAND_HZ)
    delay = fit[f"{name} delay"]
    assert abs(delay.value - 0.045) < 0.002
    assert abs(delay.value - 0.045) < 4 * delay.standard_error
    assert delay.unit == "s"
    assert fit[f"{name} gain"].value == pytest.approx(8.0, rel=0.05)
    assert fit["stiffness"].value == pytest.approx(60.0, rel=0.03)


def test_a_free_response_finds_the_gain_of_a_second_order_path(exact):
    stretch = stretch_velocity(exact, "reflex+")
    inner = np.array([0.06, 4.0, 0.9])
    (reflex,) = pass_through(stretch, RATE_HZ, kernel("reflex-second-order"), inner)
    fit = fit_terms(
        driven(exact, 0.5 * exact.velocity_rad_s + 5.0 * reflex), "damping,reflex-fir+", BAND_HZ
    )
    assert fit["reflex-fir+ gain"].value == pytest.approx(5.0, rel=0.03)
    assert fit.vaf_percent > 99.9


def test_without_a_sign_the_data_decide(exact):
    stretch = stretch_velocity(exact, "reflex-")
    (reflex,) = pass_through(stretch, RATE_HZ, kernel("reflex"), np.array([0.045]))
    fit = fit_terms(driven(exact, exact.angle_rad + reflex), "stiffness,reflex", BAND_HZ)
    assert fit.terms == ("stiffness", "reflex-")
    assert "decided for stretch by motion toward negative angle" in fit.remarks[0]


def test_white_noise_passes_for_white_and_a_forgotten_term_does_not(exact):
    rng = np.random.default_rng(8)
    tests = []
    for _ in range(20):
        torque = exact.angle_rad + 0.05 * rng.standard_normal(exact.angle_rad.size)
        tests.append(fit_terms(driven(exact, torque), "stiffness", BAND_HZ).test)
    assert sum(test.ljung_box_p < 0.05 for test in tests) <= 4
    assert sum(test.input_p < 0.05 for test in tests) <= 4
    torque = torque + 0.05 * exact.velocity_rad_s
    assert fit_terms(driven(exact, torque), "stiffness", BAND_HZ).test.input_p < 1e-3


def test_standard_errors_are_those_of_repetition(exact):
    rng = np.random.default_rng(9)
    found = []
    for _ in range(40):
        torque = 3.0 * exact.angle_rad + 0.05 * rng.standard_normal(exact.angle_rad.size)
        found.append(fit_terms(driven(exact, torque), "stiffness,damping", BAND_HZ)["stiffness"])
    scatter = np.std([one.value for one in found], ddof=1)
    assert np.median([one.standard_error for one in found]) == pytest.approx(scatter, rel=0.35)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("inertia,dampng", "there is no term 'dampng'; known: inertia, damping"),
        ("reflex-slow", "followed by + or - for the direction of motion that stretches"),
        ("inertia,inertia", "inertia is named twice"),
        (" , ", "no term is named"),
        ("reflex+,reflex-fir+", "one reflex fits each direction"),
    ],
)
def test_a_wrong_name_is_one_sentence(names, words):
    with pytest.raises(UserError) as raised:
        parse_terms(names)
    assert words in str(raised.value)


def test_what_the_data_cannot_tell_apart_is_named(exact):
    with pytest.raises(ValueError, match=r"cannot distinguish damping, damping\+ and damping-"):
        fit_terms(
            driven(exact, exact.velocity_rad_s), "inertia,damping,directional-damping", BAND_HZ
        )


def test_an_offset_needs_a_band_from_zero(exact):
    with pytest.raises(ValueError, match=r"begins at 0.15 Hz; begin the band at 0 Hz"):
        fit_terms(driven(exact, exact.velocity_rad_s), "damping,offset", (0.15, 20.0))


def test_a_term_that_the_motion_never_shows_is_named():
    n = 5000
    position = np.linspace(0.0, 1.0, n)
    motion = wideband_from_angle(position**2, position, RATE_HZ, 60.0)
    with pytest.raises(ValueError, match="damping- is zero throughout"):
        fit_terms(motion, "stiffness,damping-", BAND_HZ)
