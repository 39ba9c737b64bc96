"""Checks of an epoch, on signals whose answer is known in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import rigidimeter as rm
from rigidimeter.analysis.estimation import longest_part
from rigidimeter.core.findings import UNKNOWN_EFFECT
from rigidimeter.core.records import Channel, Epoch, LeftOut
from rigidimeter.core.settings import parse_settings

JOINT = np.array([0.005, 0.14, 1.8])
PARTS = ((0.31, 0.02), (0.73, 0.02), (1.51, 0.01), (3.13, 0.006), (6.07, 0.003), (9.01, 0.002))


def an_epoch(rate_hz=500.0, length_s=20.0, push=lambda t: 0.0 * t, **changed):
    """A joint of J, B and K that sines move, its torque with noise, and a push of the subject."""
    time_s = np.arange(round(length_s * rate_hz)) / rate_hz
    angle, velocity, acceleration = np.zeros((3, time_s.size))
    for i, (frequency_hz, size) in enumerate(PARTS):
        w = 2 * math.pi * frequency_hz
        phase = w * time_s + i * i
        angle += size * np.sin(phase)
        velocity += size * w * np.cos(phase)
        acceleration -= size * w**2 * np.sin(phase)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(time_s.size)
    explained = np.column_stack([acceleration, velocity, angle]) @ JOINT
    values = {
        "torque_nm": explained - push(time_s) + noise,
        "angle_rad": angle,
        "velocity_rad_s": velocity,
    }
    values |= {name: make(time_s, values) for name, make in changed.items()}
    channels = {name: Channel(name, time_s, x) for name, x in values.items() if x is not None}
    return Epoch("made", "1", channels, "OFF", task="prbs")


def fit_of(epoch, method="bandlimited", **settings):
    (fit,) = rm.estimate([epoch], method, settings=parse_settings(settings)).fits
    return fit


def said(epoch, method="bandlimited", **settings):
    """Return what is found of an epoch, by name."""
    return {one.name: one for one in fit_of(epoch, method, **settings).findings}


def sine(frequency_hz, amplitude_nm):
    return lambda t: amplitude_nm * np.sin(2 * math.pi * frequency_hz * t)


# --- what can be used ---------------------------------------------------------------------------


def test_a_torque_that_hung_is_left_out():
    def hung(t, values):
        return np.where((t >= 8.0) & (t <= 9.0), 0.07, values["torque_nm"])

    fit = fit_of(an_epoch(torque_nm=hung))
    assert fit.value == pytest.approx(JOINT, rel=2e-3)
    frozen = next(one for one in fit.findings if one.name == "frozen")
    assert (frozen.level, frozen.condition) == ("note", "OFF")
    assert (frozen.value, frozen.facts["start_s"]) == pytest.approx((1.0, 8.0))
    assert frozen.facts["used_s"] == pytest.approx(frozen.facts["length_s"] - 1.0, abs=0.01)


def test_lost_samples_do_not_move_the_joint():
    cut = {}
    epoch = an_epoch()
    for name, one in epoch.channels.items():
        kept = (one.time_s < 5.3) | (one.time_s > 5.9)
        cut[name] = replace(one, time_s=one.time_s[kept], values=one.values[kept])
    lost = replace(epoch, channels=cut, left_out=(LeftOut(5.3, 5.9, "cut", "lost_samples"),))
    fit = fit_of(lost)
    assert fit.value == pytest.approx(JOINT, rel=2e-3)
    (told,) = (one for one in fit.findings if one.name == "lost_samples")
    assert told.value == pytest.approx(3.0, abs=0.01)


def test_the_longest_part_is_an_epoch_and_where_too_little_is_left_there_is_no_fit():
    epoch = replace(an_epoch(), left_out=(LeftOut(4.0, 5.0), LeftOut(16.0, 16.5)))
    part = longest_part(epoch).channels["torque_nm"].time_s
    assert (part[0], part[-1]) == pytest.approx((5.0, 16.0), abs=0.01)
    failed = fit_of(replace(epoch, left_out=(LeftOut(0.5, 19.5),))).outcome
    assert failed.kind == "failed"
    assert "leaves 0 s" in failed.reason


# --- sensors ------------------------------------------------------------------------------------


def scaled_and_late(scale, late_s):
    def made(t, values):
        w = 2 * math.pi * np.array([one for one, _ in PARTS])
        a = np.array([size for _, size in PARTS])
        phase = np.outer(t - late_s, w) + np.arange(w.size) ** 2
        return (a * w * np.cos(phase)).sum(axis=1) / scale

    return made


def test_scale_and_delay_of_the_velocity_are_told():
    wide, late = (
        said(an_epoch(velocity_rad_s=scaled_and_late(*both))) for both in ((1.2, 0.0), (1.0, 0.008))
    )
    assert wide["velocity_scale"].facts["scale"] == pytest.approx(1.2, rel=1e-3)
    assert late["velocity_delay"].value == pytest.approx(8.0, rel=0.05)
    assert not {"velocity_scale", "velocity_delay"} & said(an_epoch()).keys()


@pytest.mark.parametrize("gap_s", [0.0, 1.0])
@pytest.mark.parametrize("worse", ["velocity", "angle"])
def test_a_ripple_has_its_share_and_the_torque_says_in_which_motion(worse, gap_s):
    w = 2 * math.pi * np.array([2.3, 4.7, 8.1])

    def rippled(t, values):
        phase, size = np.outer(t, w), 0.15 * np.std(values["velocity_rad_s"]) / math.sqrt(1.5)
        if worse == "velocity":
            return values["velocity_rad_s"] + size * np.sin(phase).sum(axis=1)
        return values["angle_rad"] - (size * np.cos(phase) / w).sum(axis=1)

    name = {"velocity": "velocity_rad_s", "angle": "angle_rad"}[worse]
    epoch = replace(an_epoch(**{name: rippled}), left_out=(LeftOut(8.0, 8.0 + gap_s),))
    finding = said(epoch if gap_s else replace(epoch, left_out=()))["velocity_shape"]
    assert finding.value == pytest.approx(15.0, rel=0.05)
    assert finding.facts["variant"] == worse


def test_a_torque_that_is_a_function_of_the_angle_is_no_torque_of_a_joint():
    of_angle = an_epoch(torque_nm=lambda t, values: 1.8 * values["angle_rad"])
    found = said(of_angle)
    assert found["static_torque"].value < 0.1
    assert found["computed_torque"].facts["origin"] == "the motion"
    assert fit_of(of_angle).outcome.kind == "excluded"
    assert "computed_torque" not in said(replace(of_angle, virtual=True))
    assert not {"static_torque", "computed_torque"} & said(an_epoch()).keys()


# --- the subject's own torque -------------------------------------------------------------------

OWN = {"voluntary_torque", "active_movement", "tremor"}


def test_a_relaxed_joint_shows_no_torque_of_its_own():
    assert not OWN & said(an_epoch()).keys()
    assert not OWN & said(an_epoch(push=lambda t: 0.1 * (t - 10.0))).keys()


def test_a_push_is_found_with_its_power_and_its_seconds():
    """0.3 N·m at 1.1 Hz, in the second half alone."""
    push = lambda t: np.where(t >= 10.0, sine(1.1, 0.3)(t), 0.0)  # noqa: E731
    epoch = an_epoch(push=push)
    told = said(epoch)
    share, active = told["voluntary_torque"], told["active_movement"]
    assert share.facts["sd_nm"] == pytest.approx(0.15, rel=0.05)
    torque_nm = np.std(epoch.channels["torque_nm"].values)
    assert share.value == pytest.approx(100 * (0.15 / torque_nm) ** 2, rel=0.1)
    assert active.value == pytest.approx(50.0, abs=6.0)
    assert active.facts["first_s"] == pytest.approx(9.5, abs=0.6)
    assert share.level == active.level == "caution"
    assert share.effect == UNKNOWN_EFFECT


@pytest.mark.parametrize("rate_hz", [100.0, 500.0])
def test_a_tremor_is_a_line_that_stands_out(rate_hz):
    """At 100 samples/s too, where a fit without instruments ends at 6 Hz."""
    channels = {"velocity_rad_s": lambda t, _: None} if rate_hz < 200 else {}
    told = said(an_epoch(rate_hz, push=sine(7.4, 0.1), **channels))
    assert told.keys() & OWN == {"tremor"}
    facts = told["tremor"].facts
    assert facts["frequency_hz"] == pytest.approx(7.4, abs=0.03)
    assert facts["amplitude_nm"] == pytest.approx(0.1, rel=0.05)


def test_a_loop_that_is_stated_decides_whether_a_push_matters():
    """The interval by noise holds what a weak loop makes of it; that of a paper does not."""
    epoch, stated = an_epoch(push=sine(1.1, 0.3)), {"controller": {"inertia_kg_m2": 0.05}}
    for method, settings, level, variant in (
        ("bandlimited", {}, "caution", None),
        ("bandlimited", stated, "note", "in_interval"),
        ("published", stated, "caution", None),
    ):
        finding = said(epoch, method, **settings)["voluntary_torque"]
        assert (finding.level, finding.facts.get("variant")) == (level, variant)


def test_a_level_of_the_settings_stands_whatever_is_harmless():
    levels = {"levels": {"voluntary_torque": "exclude"}}
    strict = {"controller": {"inertia_kg_m2": 0.05}, "diagnostics": levels}
    assert fit_of(an_epoch(push=sine(1.1, 0.3)), **strict).outcome.kind == "excluded"


# --- muscles ------------------------------------------------------------------------------------


def with_emg(amplitude, rate_hz=1000.0):
    """Return an epoch with EMG, noise of 1 µV times an amplitude."""
    epoch = an_epoch()
    time_s = np.arange(round(20.0 * rate_hz)) / rate_hz
    noise = 1e-6 * np.random.default_rng(3).standard_normal(time_s.size)
    emg = Channel("emg_v", time_s, noise * amplitude(time_s, epoch.channels["velocity_rad_s"]))
    return replace(epoch, channels={**epoch.channels, emg.name: emg})


def test_bursts_close_together_are_one_and_short_ones_none():
    def bursting(time_s, _):
        spans = ((1.0, 1.5), (1.6, 2.0), (4.0, 4.05), (6.0, 7.0))
        return 1.0 + 9.0 * sum((time_s >= start) & (time_s < stop) for start, stop in spans)

    fit = fit_of(with_emg(bursting))
    edges = [(one.start_s, one.stop_s) for one in fit.activity.stretches]
    assert np.ravel(edges) == pytest.approx([1.0, 2.0, 6.0, 7.0], abs=0.1)
    assert not any(one.locked for one in fit.activity.stretches)
    assert fit.activity.left_out_percent == pytest.approx(100 * 2.4 / 20, abs=1.5)


def test_bursts_of_the_stretch_stay_in():
    def stretched(time_s, velocity):
        late = np.interp(time_s - 0.06, velocity.time_s, velocity.values)
        return 1.0 + 60.0 * np.maximum(late, 0.0)

    activity = fit_of(with_emg(stretched)).activity
    assert len(activity.stretches) > 5
    assert all(one.locked for one in activity.stretches)
    assert activity.left_out_percent == 0.0
