"""Named terms: closed forms, names, and which model is recommended."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from tests.scenarios.scenario import scenario

from rigidimeter.analysis.estimation import (
    TERMS,
    Term,
    better_clock,
    candidates,
    compare_models,
    fit_models,
    from_zero,
    observations_of,
    parse_terms,
    prepare,
    term_names,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings, parse_settings

JBK = "inertia,damping,stiffness"
RATE_HZ = 500.0
TRUTH = {"inertia": 0.01, "damping": 0.2, "stiffness": 3.0}


def motion(late_s=0.0, duration_s=30.0, high_hz=8.0):
    """Return time, and angle, velocity and acceleration of a sum of sinusoids, exact."""
    rng = np.random.default_rng(3)
    t = np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    hz = np.linspace(0.2, high_hz, 60)
    w, phase = 2 * np.pi * hz[:, None], rng.uniform(0, 2 * np.pi, hz.size)[:, None]
    turn, size = w * (t - late_s) + phase, 0.02 / (1 + hz[:, None])
    x, v, a = size * np.sin(turn), size * w * np.cos(turn), -size * w**2 * np.sin(turn)
    return t, x.sum(0), v.sum(0), a.sum(0)


def fit_model(seen, terms):
    return fit_models(seen, [terms]).rows[0]


def of_epoch(epoch, settings, band_settings=None):
    ready = prepare([epoch], settings, clocks=False).perturbed
    return observations_of([one._replace(settings=band_settings or settings) for one in ready])


def observed(torque, *, high_hz=None, shift_rad=0.0, **stated):
    t, x, v, _ = motion()
    values = {"torque_nm": torque, "angle_rad": x + shift_rad, "velocity_rad_s": v}
    channels = {name: Channel(name, t, one) for name, one in values.items()}
    settings = parse_settings(stated)
    band = settings if high_hz is None else from_zero(settings, high_hz)
    return of_epoch(Epoch("made", "1", channels, "OFF", "prbs"), settings, band)


def of_joint(**coefficients):
    _, x, v, a = motion()
    columns = {
        "inertia": a, "damping": v, "stiffness": x, "quadratic": x**2, "cubic": x**3,
        "damping+": np.maximum(v, 0), "damping-": np.minimum(v, 0), "offset": np.ones_like(x),
        "stiffness+": x * (v > 0), "stiffness-": x * (v < 0), "coulomb": np.tanh(v / 0.02),
        "coulomb+": np.tanh(np.maximum(v, 0) / 0.02), "coulomb-": np.tanh(np.minimum(v, 0) / 0.02),
    }  # fmt: skip
    return sum(value * columns[name] for name, value in coefficients.items())


@pytest.mark.parametrize(
    ("name", "exact"),
    [("cubic", 3e-4), ("damping+", 3e-4), ("stiffness-", 2e-3), ("coulomb", 1e-3)],
)
def test_a_term_is_found_beside_j_b_k(name, exact):
    truth = TRUTH | {name: 0.1 if name == "coulomb" else 1.7}
    row = fit_model(observed(of_joint(**truth)), list(truth))
    for term, value in truth.items():
        assert row.fit.of(term).value == pytest.approx(value, rel=exact), row
    assert row.fit.vaf_percent == pytest.approx(100.0, abs=1e-2)


def test_halves_of_a_band_from_zero_have_their_means():
    truth = {"inertia": 0.01, "damping+": 0.2, "damping-": 0.4, "coulomb+": 0.03, "coulomb-": 0.05}
    row = fit_model(observed(of_joint(**truth), high_hz=20.0), list(truth))
    for term, value in truth.items():
        assert row.fit.of(term).value == pytest.approx(value, rel=2e-3), term


def test_lines_count_alike_unless_the_robot_gives_way_to_torque():
    torque, robot = of_joint(**TRUTH, coulomb=0.05), Settings().controller.model_dump()
    (seen,) = observed(torque)
    alike, by_noise = (
        fit_model(one, JBK).fit for one in ([seen], observed(torque, controller=robot))
    )
    both = np.column_stack([seen.motion, seen.torque_nm])
    both = np.concatenate([both.real, both.imag])
    least = np.linalg.lstsq(both[:, :3], both[:, 3])[0]
    np.testing.assert_allclose([alike.of(name).value for name in JBK.split(",")], least, rtol=1e-6)
    assert by_noise.vaf_percent < alike.vaf_percent - 1e-3


def test_a_model_of_one_term_is_fitted():
    row = fit_model(observed(of_joint(stiffness=3.0)), "stiffness")
    assert row.problem == ""
    assert row.fit.of("stiffness").value == pytest.approx(3.0, rel=1e-6)


def test_an_offset_is_what_the_mean_is_beyond_the_terms():
    torque = of_joint(**TRUTH, offset=0.5)
    row = fit_model(observed(torque, high_hz=20.0, shift_rad=0.2), f"{JBK},offset")
    assert row.problem == ""
    assert row.fit.of("stiffness").value == pytest.approx(3.0, rel=1e-6)
    assert row.fit.of("offset").value == pytest.approx(0.5 - 0.2 * 3.0, abs=1e-6)


def test_a_bend_of_stiffness_is_found_inside_a_motion_far_from_the_sensors_zero():
    _, x, _, _ = motion()
    bend_rad, middle_rad = 0.004, 0.01
    side = 1.5 * bend_rad * np.log(np.cosh((x - middle_rad) / bend_rad))
    row = fit_model(observed(of_joint(**TRUTH) + side, shift_rad=0.5), f"{JBK},stiffness-by-side")
    assert row.fit.of("stiffness-by-side").value == pytest.approx(1.5, rel=0.01)
    assert row.fit.of("stiffness").value == pytest.approx(3.0, rel=0.01)
    assert row.fit.of("stiffness-by-side bend").value == pytest.approx(bend_rad, rel=0.05)


@pytest.mark.parametrize("name", ["reflex+", "reflex-second-order-"])
def test_a_known_reflex_is_recovered(name):
    """The late velocity is in closed form, and the muscle a discrete filter: nothing of ours."""
    truth = {"delay": 0.045, "natural frequency": 2.5, "damping ratio": 0.9}
    _, _, late, _ = motion(late_s=truth["delay"])
    reflex = np.maximum(late, 0.0) if name.endswith("+") else np.minimum(late, 0.0)
    if "second" in name:
        w = 2 * np.pi * truth["natural frequency"]
        plant = ([w**2], [1.0, 2 * truth["damping ratio"] * w, w**2])
        b, a, _ = signal.cont2discrete(plant, 1 / RATE_HZ, "foh")
        reflex = signal.lfilter(b.ravel(), a, reflex)
    noise = 0.01 * np.random.default_rng(5).standard_normal(reflex.size)
    row = fit_model(observed(of_joint(**TRUTH) + 0.5 * reflex + noise), f"{JBK},{name}")
    for inner, value in truth.items() if "second" in name else [("delay", 0.045)]:
        one = row.fit.of(f"{name} {inner}")
        assert abs(one.value - value) < 4 * one.standard_error
        assert one.value == pytest.approx(value, rel=0.05)
    assert row.fit.of(f"{name} gain").value == pytest.approx(0.5, rel=0.02)


def test_without_a_sign_the_data_decide():
    _, _, late, _ = motion(late_s=0.045)
    row = fit_model(observed(of_joint(**TRUTH) + 0.3 * np.minimum(late, 0)), f"{JBK},reflex")
    assert row.terms[-1] == "reflex-"
    assert "decided for stretch by motion toward negative angle" in row.fit.remarks[0]


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (f"{JBK},offset", "offset is constant and does not pass a band that begins at 0.15 Hz"),
        (f"{JBK},directional-damping", "cannot distinguish damping, damping+ and damping-"),
    ],
)
def test_what_cannot_be_fitted_says_why(names, words):
    assert words in fit_model(observed(of_joint(**TRUTH)), names).problem


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("inertia,dampng", "there is no term 'dampng'; known: "),
        ("inertia,cuff", "there is no term 'cuff'"),
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


def test_candidates_are_one_further_term_each():
    found = candidates(f"{JBK},reflex,directional-damping".split(","))
    more = [one[3:] for one in found]
    assert more == [(), ("reflex",), ("damping+",), ("reflex-fir",), ("reflex-second-order",)]


def test_a_term_from_outside_is_one_record_in_one_list(monkeypatch):
    _, x, _, _ = motion()
    own = Term("fifth", "N·m/rad⁵", "spring", lambda m, _: m.of(m.angle**5)[None], asked="quintic")
    monkeypatch.setattr("rigidimeter.analysis.estimation.terms.TERMS", [*TERMS, own])
    assert "quintic" in term_names()
    torque = (
        of_joint(**TRUTH) + 90.0 * (x - x.mean()) ** 5
    )  # a term that is tested is from the mean
    row = fit_model(observed(torque), f"{JBK},quintic")
    assert row.fit.of("quintic").value == pytest.approx(90.0, rel=1e-4)


def noisy(torque):
    noise = 0.005 * np.random.default_rng(1).standard_normal(torque.size)
    return observed(torque + noise)


def test_what_is_not_enough_is_not_recommended():
    rng = np.random.default_rng(80)
    low = signal.butter(2, 10.0, fs=RATE_HZ, output="sos")
    torque = 3.0 * signal.sosfilt(low, rng.standard_normal(motion()[0].size))
    compared = compare_models(observed(torque), candidates(JBK.split(",")))
    assert compared.recommended is None
    assert "none of these models explains this torque: the best" in compared.reason


def test_a_friction_that_pushes_forbids_what_it_predicts_far_better_than():
    models = candidates(f"{JBK},coulomb".split(","))
    compared = compare_models(noisy(of_joint(**TRUTH, coulomb=-0.05)), models)
    assert compared.recommended is None
    assert "inertia+damping+stiffness+coulomb predicts" in compared.reason
    assert "it pushes, and a friction resists" in compared.rows[1].problem


def test_the_inertia_is_needed_and_no_more():
    models = [["damping", "stiffness"], JBK.split(","), [*JBK.split(","), "cubic"]]
    compared = compare_models(noisy(of_joint(**TRUTH)), models)
    assert compared.recommended is compared.rows[1]
    assert "of what damping+stiffness leaves" in compared.reason


def pushed(zero_rad=None, **joint):
    """Return an epoch of a subject who pushes, with the perturbation, and its J, B and K.

    With `zero_rad` in a band from 0 Hz, of a sensor that shows so much more.
    """
    made = scenario("one", subject={"voluntary_nm": 0.2}, joint=joint)
    ((epoch,), truth), settings = made.simulated(1, 1), made.analysed_with()
    band = settings
    if zero_rad is not None:
        angle = epoch.channels["angle_rad"]
        shifted = Channel("angle_rad", angle.time_s, angle.values + zero_rad)
        epoch = replace(epoch, channels={**epoch.channels, "angle_rad": shifted})
        band = from_zero(settings, settings.estimation.band_high_closed_loop_hz)
    return of_epoch(epoch, settings, band), truth[0]


def test_from_zero_the_perturbation_is_the_instrument_of_all_lines_but_that_of_the_means():
    (above, _), (seen, values) = pushed(), pushed(zero_rad=0.2)
    plain = fit_model(above, JBK).fit
    fit = fit_model(seen, f"{JBK},offset").fit
    for name, value in zip(JBK.split(","), values, strict=True):
        one = fit.of(name)
        assert abs(one.value - value) < 3 * one.standard_error
        assert one.standard_error == pytest.approx(plain.of(name).standard_error, rel=0.05)
    grid, channels = seen[0].grid, seen[0].epoch.channels
    weight = grid.window[0] ** 2 / grid.energy
    torque, angle = (
        weight @ channels[name].values[: weight.size] for name in ("torque_nm", "angle_rad")
    )
    offset = torque - fit.of("stiffness").value * angle
    assert fit.of("offset").value == pytest.approx(offset, abs=2e-3)


@pytest.mark.parametrize(
    ("joint", "term", "truth"),
    [
        ({"reflex_nm_s_rad": 0.1, "reflex_delay_s": 0.06}, "reflex", {"gain": 0.1, "delay": 0.06}),
        ({"coulomb_nm": 0.1}, "coulomb", {"": 0.1, "width": 0.02}),
        ({"cubic_nm_rad3": 40.0}, "cubic", {"": 40.0}),
    ],
)
def test_torque_of_the_subject_biases_no_term_where_the_perturbation_was_recorded(
    joint, term, truth
):
    seen, values = pushed(**joint)
    compared = compare_models(seen, candidates(f"{JBK},{term}".split(",")))
    assert compared.recommended is not None
    fit, found = compared.recommended.fit, compared.recommended.terms[3]
    assert found.rstrip("+") == term
    for name, value in zip(JBK.split(","), values, strict=True):
        one = fit.of(name)
        assert abs(one.value - value) < 3 * one.standard_error
    for name, value in truth.items():
        one = fit.of(f"{found} {name}".strip())
        assert abs(one.value - value) < 3 * one.standard_error
    assert fit.test.input_p > 0.01


def test_friction_is_fitted_to_the_torque_as_recorded_and_a_late_torque_is_moved():
    seen, models = noisy(of_joint(**TRUTH, coulomb=0.05)), [f"{JBK},coulomb".split(",")]
    moved = [one.late(0.004) for one in seen]
    chosen, remark = better_clock(moved, seen, 0.004, models)
    assert chosen is seen
    assert "torque as recorded: J, B and K alone would have it 4 ms late" in remark
    assert better_clock(seen, moved, 0.004, models) == (seen, "")


def test_what_a_check_forbids_is_not_recommended():
    compared = compare_models(noisy(of_joint(**TRUTH)), [JBK.split(",")], refused="it is excluded")
    assert compared[1:] == (None, "it is excluded")
    assert compared.rows[0].name == "inertia+damping+stiffness"
