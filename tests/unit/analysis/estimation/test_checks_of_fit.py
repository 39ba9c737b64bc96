"""Checks of motion, fit and loop: what each says of a joint in its loop, or of a spoilt one."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

import rigidimeter as rm
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

RELAXED = {"subject": {"OFF": {"voluntary_sd_nm": 0.0}}}
TRUTH = np.array([0.0045, 0.1368, 1.751])


def simulated(seed=3):
    joint, settings = JointDynamics(*TRUTH), parse_settings(RELAXED)
    return simulate_epochs(settings, 1, joints=[joint], conditions="OFF", seed=seed).epoch(0)


@pytest.fixture(scope="module")
def epoch():
    return simulated()


def fit_of(epoch, method="iv", **settings):
    (fit,) = rm.estimate([epoch], method, settings=parse_settings(settings)).fits
    return fit


def said(epoch, method="iv", **settings):
    """Return what is found of an epoch, by name."""
    return {one.name: one for one in fit_of(epoch, method, **settings).findings}


def with_values(epoch, **values):
    there = {n: replace(epoch.channels[n], values=v) for n, v in values.items()}
    return replace(epoch, channels={**epoch.channels, **there})


def with_torque(epoch, change):
    torque = epoch.channels["torque_nm"]
    return with_values(epoch, torque_nm=change(torque.time_s, torque.values))


@pytest.mark.parametrize("method", ["iv", "bandlimited", "spectral"])
def test_a_sound_epoch_shows_nothing_but_the_colour_of_its_residual(epoch, method):
    assert said(epoch, method).keys() <= {"residual_whiteness"}


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
    return Epoch("a", "1", channels, task="prbs")


@pytest.mark.parametrize("band_hz", [(1.9, 2.1), (0.2, 8.0)], ids=["narrow", "wide"])
def test_a_narrow_motion_cannot_tell_inertia_from_stiffness(band_hz):
    noise = np.random.default_rng(3).normal(size=4000)
    sos = signal.butter(4, band_hz, "bandpass", fs=200.0, output="sos")
    found = said(moved_by(0.1 * signal.sosfiltfilt(sos, noise)), "bandlimited")
    assert ({"conditioning", "imposed_sinusoid"} <= found.keys()) == (band_hz[0] > 1)
    if band_hz[0] > 1:
        facts = found["conditioning"].facts
        assert (facts["first"], facts["second"]) == ("J", "K")
        assert 1.7 < facts["low_hz"] < 2.0 < facts["high_hz"] < 2.3
    else:
        assert "conditioning" not in found


def test_coherence_is_the_share_that_follows(epoch):
    other = simulated(seed=5).channels["perturbation_nm"].values
    strange = np.roll(other[: len(epoch.channels["perturbation_nm"])], 3777)
    strange = with_values(epoch, perturbation_nm=strange)
    by_perturbation, by_motion, printed = (
        said(strange, method)["coherence"] for method in ("iv", "bandlimited", "published")
    )
    assert by_perturbation.value < 0.35
    assert by_perturbation.facts["percent"] == 100 * by_perturbation.value
    levels = [one.level for one in (by_perturbation, by_motion, printed)]
    assert levels == ["note", "note", "caution"]


def test_power_outside_the_band_is_told_and_white_noise_is_none(epoch):
    size, rng = 3 * np.std(epoch.channels["torque_nm"].values), np.random.default_rng(1)
    for added, told in (
        (lambda t: rng.normal(size=t.size), False),
        (lambda t: np.sin(2 * np.pi * 0.05 * t), True),
        (lambda t: np.sin(2 * np.pi * 60.0 * t), True),
    ):
        found = said(with_torque(epoch, lambda t, x, more=added: x + size * more(t)))
        assert ("band_share" in found) == told
        assert not told or found["band_share"].facts["signal"] == "torque"


def test_what_follows_the_perturbation_and_is_not_explained_has_its_size_and_lag(epoch):
    """A tenth of a second late, three tenths of the torque's SD."""
    late_s, share, perturbation = 0.1, 0.3, epoch.channels["perturbation_nm"]

    def echoed(t, x):
        shifted = np.roll(perturbation.values, round(late_s * perturbation.rate_hz))
        echo = np.interp(t, perturbation.time_s, shifted)
        return x + share * np.std(x) / np.std(echo) * echo

    fit = fit_of(with_torque(epoch, echoed))
    told = next(one for one in fit.findings if one.name == "residual_perturbation")
    assert told.value == pytest.approx(100 * share / math.hypot(1, share), rel=0.25)
    assert told.facts["lag_s"] == pytest.approx(late_s, abs=0.01)
    assert (told.level, told.facts["variant"]) == ("note", "chance")
    assert fit.outcome.kind == "excluded"  # no term has that shape


def test_a_joint_that_turns_round_half_way_is_not_predicted(epoch):
    turned = with_torque(epoch, lambda t, x: np.where(t < np.mean(t[[0, -1]]), 1, -1) * x)
    held_out = said(turned, "bandlimited")["held_out_vaf"]
    assert held_out.value == pytest.approx(-300.0, abs=30.0)  # twice the torque is left
    assert held_out.level == "exclude"


def test_the_flatness_of_a_residual_is_that_of_its_spectrum(epoch):
    white = np.random.default_rng(2).normal(size=len(epoch.channels["torque_nm"]))
    slow = signal.lfilter([1], [1, -0.99], white)
    flat, coloured = (
        said(with_torque(epoch, lambda t, x, more=one: x + more)) for one in (white, slow)
    )
    assert "residual_whiteness" not in flat
    # Of |1/(1 + f/f₀)|² with f₀ = 1.6 Hz up to 10 Hz.
    f = np.linspace(0.15, 10.0, 2000) / (0.01 * 1000 / (2 * np.pi))
    expected = np.exp(np.mean(np.log(1 / (1 + f**2)))) / np.mean(1 / (1 + f**2))
    assert coloured["residual_whiteness"].value == pytest.approx(expected, rel=0.25)


def test_numbers_that_no_joint_has_are_told(epoch):
    """A joint that is 300 times too heavy would make the loop unstable too."""
    reaction, heavy = (fit_of(with_torque(epoch, lambda _, x, by=k: by * x)) for k in (-1, 300))
    (negative,) = reaction.findings
    assert (negative.name, negative.level) == ("negative_parameters", "exclude")
    assert (negative.value, negative.facts["variant"]) == (3.0, "reaction")
    found = {one.name: one for one in heavy.findings}
    facts = found["implausible_parameters"].facts
    assert (facts["symbol"], facts["side"]) == ("J", "large")
    assert found["unstable_loop"].value > 0
    noise = np.random.default_rng(3).normal(size=len(epoch.channels["torque_nm"]))
    nothing = said(with_torque(epoch, lambda _, x: noise))["negative_parameters"]
    assert (nothing.value, nothing.level) == (3.0, "caution")
    assert nothing.facts["variant"] == "noise"


def test_what_the_loop_does_is_told_by_what_is_known_of_it(epoch):
    """Recorded, stated, or neither; of a paper's fit whose intervals do not hold the pull."""
    alone = {n: c for n, c in epoch.channels.items() if n in ("torque_nm", "angle_rad")}
    bare = replace(epoch, channels=alone)
    told = said(bare, "bandlimited")["loop_bias"]
    assert (told.level, told.facts["variant"]) == ("note", "not_known")
    assert "loop_bias" not in said(bare, "bandlimited", controller={"inertia_kg_m2": 0.05})
    assert "loop_bias" not in said(epoch, "bandlimited")
    pushed = with_torque(epoch, lambda t, x: x + 0.3 * np.sin(2 * np.pi * 1.1 * t))
    assert said(pushed, "published")["loop_bias"].level == "caution"


@pytest.mark.parametrize(
    ("given", "variant"),
    [
        ({}, None),
        ({"inertia_kg_m2": 0.0917, "damping_nm_s_rad": 3.21}, "shown"),
        ({"inertia_kg_m2": 0.0008, "damping_nm_s_rad": 0.028}, "per_degree"),
    ],
)
def test_the_controller_that_a_recording_shows(epoch, given, variant):
    found = said(epoch, controller=given)
    assert ("controller_misfit" in found) == (variant is not None)
    if variant is not None:
        facts, true = found["controller_misfit"].facts, parse_settings({}).controller
        assert facts["variant"] == f"{variant} instrument"
        assert facts["shown_inertia"] == pytest.approx(true.inertia_kg_m2, rel=0.02)
        assert facts["shown_damping"] == pytest.approx(true.damping_nm_s_rad, rel=0.02)


def test_a_drive_that_is_not_known_leaves_a_range_of_inertia(epoch):
    """Of first order, λT / (e^(λT) − 1) of the acceleration is seen at the ticks."""
    rig = parse_settings({}).rig
    wild = np.random.default_rng(1).normal(size=len(epoch.channels["velocity_command_rad_s"]))
    found = said(with_values(epoch, velocity_command_rad_s=wild))["between_samples"]
    rate = 2 * math.pi * rig.drive_bandwidth_hz / rig.tick_rate_hz
    assert found.value == pytest.approx(100 * (math.expm1(rate) / rate - 1), rel=2e-3)
    assert found.facts["high_j"] / found.facts["low_j"] == pytest.approx(
        math.expm1(rate) / rate, rel=2e-3
    )
