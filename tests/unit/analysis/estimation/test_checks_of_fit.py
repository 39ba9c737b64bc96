"""Checks of motion, fit, loop and drive: what each says of a joint in its loop."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from rigidimeter.analysis.estimation.checks import Pull, motion
from rigidimeter.analysis.estimation.checks import fit as of_fit
from rigidimeter.analysis.estimation.observation import loop_of, observe
from rigidimeter.core.records import Channel, Delay, Epoch, Fit, Outcome
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

SETTINGS = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": 0.0}}})
TRUTH = np.array([0.0045, 0.1368, 1.751])
HALF = 0.02 * TRUTH
FIT = Fit("a", "1", "OFF", "bandlimited", Outcome(), TRUTH, HALF / 2, TRUTH - HALF, TRUTH + HALF)
FIT = replace(FIT, r_squared=0.99)
CHECKS, INSTRUMENTS = SETTINGS.diagnostics, Pull(instruments=True)


def simulated(settings=SETTINGS, seed=3):
    joint = JointDynamics(*TRUTH)
    return simulate_epochs(settings, 1, joints=[joint], conditions="OFF", seed=seed).epoch(0)


@pytest.fixture(scope="module")
def epoch():
    return simulated()


def seen(epoch, settings=SETTINGS):
    loop = loop_of(settings, epoch.channels["torque_nm"].rate_hz, None)
    return observe(epoch, settings, None, loop)


def with_values(epoch, **values):
    there = {n: replace(epoch.channels[n], values=v) for n, v in values.items()}
    return replace(epoch, channels={**epoch.channels, **there})


def names(findings):
    return [one.name for one in findings]


def named(name, findings):
    return next(one for one in findings if one.name == name)


def test_a_sound_epoch_shows_nothing_but_the_colour_of_its_residual(epoch):
    lines = seen(epoch)
    every = (motion.excitation, of_fit.following, of_fit.residual, of_fit.parameters)
    found = [one for check in every for one in check(lines, FIT, INSTRUMENTS)]
    assert set(names(found)) <= {"residual_whiteness"}


def moved_by(x, rate_hz=200.0):
    """Return an epoch of the joint moved along an angle."""
    t = np.arange(x.size) / rate_hz
    v = np.gradient(x, t)
    torque = JointDynamics(*TRUTH).torque_nm(x, v, np.gradient(v, t))
    torque = torque + 1e-3 * np.random.default_rng(0).normal(size=t.size)
    channels = {
        "torque_nm": Channel("torque_nm", t, torque),
        "angle_rad": Channel("angle_rad", t, x),
    }
    return Epoch("a", "1", channels)


@pytest.mark.parametrize(
    ("band_hz", "pair"), [((1.9, 2.1), ("J", "K")), ((0.2, 8.0), None)], ids=["narrow", "wide"]
)
def test_a_narrow_motion_cannot_tell_inertia_from_stiffness(band_hz, pair):
    noise = np.random.default_rng(3).normal(size=4000)
    sos = signal.butter(4, band_hz, "bandpass", fs=200.0, output="sos")
    lines = motion.checked_lines(seen(moved_by(0.1 * signal.sosfiltfilt(sos, noise))))
    found = motion.conditioning(lines)
    if pair is None:
        assert found == []
    else:
        assert (found[0].facts["first"], found[0].facts["second"]) == pair
        assert 1.7 < found[0].facts["low_hz"] < 2.0 < found[0].facts["high_hz"] < 2.3


def test_a_motion_at_rest_and_a_sinusoid_are_told():
    t = np.arange(4000) / 200.0
    sine = moved_by(0.3 * np.sin(2 * np.pi * t))
    lines = seen(sine)
    assert names(motion.imposed_sinusoid(lines)) == ["imposed_sinusoid"]
    still = motion.conditioning(replace(lines, motion=0 * lines.motion))
    assert math.isinf(still[0].value)
    assert still[0].facts["variant"] == "at_rest"


def test_coherence_is_the_share_that_follows(epoch):
    other = (
        simulated(seed=5)
        .channels["perturbation_nm"]
        .values[: len(epoch.channels["perturbation_nm"])]
    )
    lines = motion.checked_lines(seen(with_values(epoch, perturbation_nm=np.roll(other, 3777))))
    cause = motion.perturbation_lines(lines)
    (found,) = motion.coherence(lines, cause, FIT, INSTRUMENTS)
    assert found.value < 0.35
    assert found.facts["percent"] == 100 * found.value
    assert (found.level, found.facts["variant"]) == ("note", "instrument")
    assert motion.coherence(lines, cause, FIT, Pull())[0].level == "caution"


def test_power_outside_the_band_is_told_and_white_noise_is_none(epoch):
    torque, t = (getattr(epoch.channels["torque_nm"], of) for of in ("values", "time_s"))
    noise = 3 * np.std(torque) * np.random.default_rng(1).normal(size=t.size)
    drift, hum = (3.0 * np.std(torque) * np.sin(2 * np.pi * f * t) for f in (0.05, 60.0))
    for added, told in ((noise, False), (drift, True), (hum, True)):
        spoiled = with_values(epoch, torque_nm=torque + added)
        found = motion.band_share(seen(spoiled))
        assert [one.facts["signal"] for one in found] == ["torque"] * told


def test_what_follows_the_perturbation_and_is_not_explained_has_its_size_and_lag(epoch):
    """A tenth of a second late, three tenths of the torque's SD; independent noise is none."""
    p, torque = epoch.channels["perturbation_nm"].values, epoch.channels["torque_nm"]
    late_s, share = 0.1, 0.3
    shift = round(late_s * epoch.channels["perturbation_nm"].rate_hz)
    echo = np.interp(torque.time_s, epoch.channels["perturbation_nm"].time_s, np.roll(p, shift))
    clean = motion.checked_lines(seen(epoch))
    added = motion.checked_lines(seen(with_values(epoch, torque_nm=echo)))
    echo *= share * np.linalg.norm(clean.torque_nm) / np.linalg.norm(added.torque_nm)
    lines = motion.checked_lines(seen(with_values(epoch, torque_nm=torque.values + echo)))
    cause = motion.gain(lines.grid, (0.15, 10.0)) * motion.perturbation_lines(lines)
    (found,) = motion.residual_perturbation(lines, cause, FIT, INSTRUMENTS)
    assert found.value == pytest.approx(100 * share / math.hypot(1, share), rel=0.2)
    assert found.facts["lag_s"] == pytest.approx(late_s, abs=0.01)
    assert (found.level, found.facts["variant"]) == ("note", "chance")
    assert motion.residual_perturbation(lines, cause, FIT, Pull())[0].level == "caution"
    assert motion.residual_perturbation(clean, cause, FIT, Pull()) == []


def test_a_joint_that_turns_round_half_way_is_not_predicted(epoch):
    torque = epoch.channels["torque_nm"]
    middle_s = np.mean(torque.time_s[[0, -1]])
    turned = with_values(epoch, torque_nm=np.where(torque.time_s < middle_s, 1, -1) * torque.values)
    found = named("held_out_vaf", of_fit.residual(seen(turned), FIT, Pull()))
    assert found.value == pytest.approx(-300.0, abs=30.0)  # twice the torque is left
    assert found.level == "exclude"
    assert "held_out_vaf" not in names(of_fit.residual(seen(epoch), FIT, Pull()))


def test_the_flatness_of_a_residual_is_that_of_its_spectrum(epoch):
    torque, rng = epoch.channels["torque_nm"].values, np.random.default_rng(2)
    white = rng.normal(size=torque.size)
    slow = signal.lfilter([1], [1, -0.99], white)
    found = [
        of_fit.residual(seen(with_values(epoch, torque_nm=torque + added)), FIT, Pull())
        for added in (white, slow)
    ]
    assert "residual_whiteness" not in names(found[0])
    # Of |1/(1 + f/f₀)|² with f₀ = 1.6 Hz up to 10 Hz.
    f = np.linspace(0.15, 10.0, 2000) / (0.01 * 1000 / (2 * np.pi))
    expected = np.exp(np.mean(np.log(1 / (1 + f**2)))) / np.mean(1 / (1 + f**2))
    assert named("residual_whiteness", found[1]).value == pytest.approx(expected, rel=0.25)


@pytest.mark.parametrize(
    ("factors", "high", "name", "shown"),
    [
        ((1, -1, 1), 1, "negative_parameters", {"names": "B"}),
        ((-1, -1, -1), -1, "negative_parameters", {"variant": "reaction"}),
        ((-1, -1, -1), 1, "negative_parameters", {"variant": "noise"}),
        ((300, 1, 1), 1, "implausible_parameters", {"symbol": "J", "side": "large"}),
        ((1e-3, 1, 1), 1, "implausible_parameters", {"symbol": "J", "side": "small"}),
    ],
)
def test_numbers_that_no_joint_has_are_told(epoch, factors, high, name, shown):
    fit = replace(FIT, value=TRUTH * factors, high=high * TRUTH)
    found = of_fit.parameters(seen(epoch), fit, INSTRUMENTS)
    assert names(found) == [name]
    assert {key: found[0].facts[key] for key in shown} == shown
    assert (found[0].level == "exclude") == (shown.get("variant") == "reaction")


def test_gravity_is_taken_off(epoch):
    weight = {"gravity_nm": 0.5, "gravity_angle_deg": 60.0}
    settings = parse_settings({"diagnostics": weight})
    still = with_values(epoch, angle_rad=0 * epoch.channels["angle_rad"].values)
    lines = replace(seen(epoch, settings), epoch=still)
    found = named("gravity", of_fit.parameters(lines, FIT, Pull()))
    assert found.value == pytest.approx(TRUTH[2] - 0.25)


def test_the_pull_of_the_loop_is_told_by_what_is_known_of_it():
    def said(bias, in_interval=False):
        pull = Pull(None if bias is None else bias * HALF, in_interval)
        return [
            (one.level, one.facts.get("variant", "")) for one in of_fit.loop_bias(FIT, pull, CHECKS)
        ]

    assert said(None) == [("note", "not_known")]
    assert said(np.nan) == [("caution", "unknown")]
    assert said(0.4) == []
    assert said(2.0) == [("caution", "")]
    assert said(2.0, in_interval=True) == []  # 4 % of each: known to the first order
    assert said(5.0, in_interval=True) == [("caution", "first_order")]


@pytest.mark.parametrize(
    ("given", "variant"),
    [
        ({}, None),
        ({"inertia_kg_m2": 0.0917, "damping_nm_s_rad": 3.21}, "shown"),
        ({"inertia_kg_m2": 0.0008, "damping_nm_s_rad": 0.028}, "per_degree"),
    ],
)
def test_the_controller_that_a_recording_shows(epoch, given, variant):
    said = {"subject": {"OFF": {"voluntary_sd_nm": 0.0}}, "controller": given}
    settings = parse_settings(said if given else {"subject": said["subject"]})
    lines = seen(epoch, settings)
    shown = of_fit.controller_shown(lines)
    found = of_fit.controller_misfit(FIT, INSTRUMENTS, settings, shown)
    if variant is None:
        assert found == []
        assert shown.misfit_percent < 5.0
    else:
        assert found[0].facts["variant"] == f"{variant} instrument"
        true = SETTINGS.controller
        assert shown.controller.inertia_kg_m2 == pytest.approx(true.inertia_kg_m2, rel=0.02)
        assert shown.controller.damping_nm_s_rad == pytest.approx(true.damping_nm_s_rad, rel=0.02)
        assert of_fit.loop_shown(lines, None).controller == shown.controller


def test_a_loop_that_would_be_unstable_did_not_move_the_joint(epoch):
    heavy = replace(FIT, value=TRUTH * [300, 1, 1])
    (found,) = of_fit.unstable_loop(epoch, heavy, Pull(), SETTINGS)
    assert found.value > 0
    assert of_fit.unstable_loop(epoch, FIT, Pull(), SETTINGS) == []


def test_a_loop_is_known_if_it_was_recorded_or_stated():
    alone = moved_by(np.random.default_rng(0).normal(size=4000))
    stated = parse_settings({"controller": {"inertia_kg_m2": 0.05}})
    known = [of_fit.loop_shown(seen(alone, one), None) for one in (Settings(), stated)]
    assert [one is not None for one in known] == [False, True]


def test_a_drive_that_is_not_known_leaves_a_range_of_inertia(epoch):
    rate = 2 * math.pi * SETTINGS.rig.drive_bandwidth_hz / SETTINGS.rig.tick_rate_hz
    (found,) = of_fit.between_samples(epoch, FIT, INSTRUMENTS, SETTINGS, None)
    assert found.facts["low_j"] == TRUTH[0]
    assert found.facts["high_j"] / TRUTH[0] == pytest.approx(math.expm1(rate) / rate, rel=2e-3)
    channels = {n: c for n, c in epoch.channels.items() if n != "velocity_command_rad_s"}
    delay = Delay("a", 0.02 / SETTINGS.rig.tick_rate_hz)
    quick = of_fit.between_samples(
        replace(epoch, channels=channels), FIT, INSTRUMENTS, SETTINGS, delay
    )
    value = 100 * (1 / (1 - rate**2 / 12) - 1)
    assert [one.value for one in quick] == ([pytest.approx(value, rel=0.05)] if value > 1 else [])
