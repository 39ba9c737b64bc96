"""Checks of an epoch, on signals whose answer is known in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation.activity import bursts, follows_motion, joined
from rigidimeter.analysis.estimation.checks import (
    Pull,
    found,
    in_half_intervals,
    motion,
    sensors,
)
from rigidimeter.analysis.estimation.observation import observe
from rigidimeter.analysis.estimation.stretches import (
    bridged,
    longest_part,
    obstacle,
    screened,
    used_s,
)
from rigidimeter.core.findings import UNKNOWN_EFFECT
from rigidimeter.core.records import Channel, Epoch, Fit, LeftOut, Outcome
from rigidimeter.core.settings import Settings

SETTINGS = Settings()
JOINT = np.array([0.005, 0.14, 1.8])
PARTS = ((0.31, 0.02), (0.73, 0.02), (1.51, 0.01), (3.13, 0.006), (6.07, 0.003), (9.01, 0.002))
NO_PULL = Pull()


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


def a_fit(method="bandlimited"):
    half = 0.05 * JOINT
    return Fit("made", "1", "OFF", method, Outcome(), JOINT, half / 2, JOINT - half, JOINT + half)


def seen(epoch):
    return observe(epoch, SETTINGS, None, None)


def moved(epoch, pull=NO_PULL):
    """Return what is found of the subject's own torque, by name."""
    return {one.name: one for one in motion.own_torque(seen(epoch), a_fit(), pull)}


def sine(frequency_hz, amplitude_nm):
    return lambda t: amplitude_nm * np.sin(2 * math.pi * frequency_hz * t)


# --- what can be used ---------------------------------------------------------------------------


def test_a_torque_that_hung_is_left_out_and_bridged_by_a_line():
    def hung(t, values):
        return np.where((t >= 8.0) & (t <= 9.0), 0.07, values["torque_nm"])

    epoch = an_epoch(torque_nm=hung)
    left = screened(epoch, SETTINGS)
    (stretch,) = left.left_out
    assert (stretch.start_s, stretch.stop_s, stretch.check) == pytest.approx((8.0, 9.0, "frozen"))
    torque = left.channels["torque_nm"]
    inside = (torque.time_s > 8.0) & (torque.time_s < 9.0)
    assert np.ptp(np.diff(torque.values[inside])) < 1e-12
    found_in = sensors.sensors(seen(left), a_fit(), NO_PULL)
    (finding,) = in_half_intervals(replace(a_fit(), findings=tuple(found_in))).findings
    assert (finding.level, finding.condition) == ("note", "OFF")
    assert finding.facts["used_s"] == pytest.approx(finding.facts["length_s"] - 1.0, abs=0.01)


def test_lost_samples_come_back_evenly_and_a_perturbation_keeps_its_level():
    steps = lambda t, _: np.where(t % 2 < 1, 0.3, -0.3)  # noqa: E731
    epoch = an_epoch(perturbation_nm=steps)
    cut = {}
    for name, one in epoch.channels.items():
        kept = (one.time_s < 5.3) | (one.time_s > 5.9)
        cut[name] = replace(one, time_s=one.time_s[kept], values=one.values[kept])
    lost = replace(epoch, channels=cut, left_out=(LeftOut(5.3, 5.9, "cut", "lost_samples"),))
    whole = bridged(lost)
    for name, one in whole.channels.items():
        assert one.time_s == pytest.approx(epoch.channels[name].time_s, abs=1e-9)
    pushed = whole.channels["perturbation_nm"]
    assert set(pushed.values) == {0.3, -0.3}


def test_what_is_left_is_counted_with_margins_and_the_longest_part_is_an_epoch():
    epoch = replace(an_epoch(), left_out=(LeftOut(4.0, 5.0), LeftOut(16.0, 16.5)))
    last_s = epoch.channels["torque_nm"].time_s[-1]
    assert used_s(epoch, 0.0) == pytest.approx(last_s - 1.5)
    assert used_s(epoch, 1.0) == pytest.approx(2.0 + 9.0 + last_s - 1.0 - 17.5)
    part = longest_part(epoch).channels["torque_nm"].time_s
    assert (part[0], part[-1]) == pytest.approx((5.0, 16.0), abs=0.01)
    assert "leaves 0 s" in obstacle(
        replace(epoch, left_out=(LeftOut(0.5, 19.5),)), SETTINGS.estimation
    )


# --- sensors ------------------------------------------------------------------------------------


def scaled_and_late(scale, late_s):
    def made(t, values):
        w = 2 * math.pi * np.array([one for one, _ in PARTS])
        a = np.array([size for _, size in PARTS])
        phase = np.outer(t - late_s, w) + np.arange(w.size) ** 2
        return (a * w * np.cos(phase)).sum(axis=1) / scale

    return made


def test_scale_and_delay_of_the_velocity_are_told():
    (wide,) = sensors.velocity(
        seen(an_epoch(velocity_rad_s=scaled_and_late(1.2, 0.002))), a_fit(), NO_PULL
    )
    assert wide.facts["scale"] == pytest.approx(1.2, rel=1e-3)
    assert sensors.velocity(seen(an_epoch()), a_fit(), NO_PULL) == []
    (late,) = sensors.velocity(
        seen(an_epoch(velocity_rad_s=scaled_and_late(1.0, 0.008))), a_fit(), NO_PULL
    )
    assert (wide.name, late.name) == ("velocity_scale", "velocity_delay")
    assert late.value == pytest.approx(8.0, rel=0.05)


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
    epoch = an_epoch(**{name: rippled})
    if gap_s:
        epoch = bridged(replace(epoch, left_out=(LeftOut(8.0, 8.0 + gap_s),)))
    (finding,) = sensors.velocity_shape(seen(epoch))
    assert finding.value == pytest.approx(15.0, rel=0.05)
    assert finding.facts["variant"] == worse


def test_a_torque_that_is_a_function_of_the_angle_is_no_torque_of_a_joint():
    of_angle = an_epoch(torque_nm=lambda t, values: 1.8 * values["angle_rad"])
    (finding,) = sensors.static_torque(seen(of_angle), a_fit(), NO_PULL)
    assert finding.value < 0.1
    assert sensors.static_torque(seen(an_epoch()), a_fit(), NO_PULL) == []
    (finding,) = sensors.computed_torque(of_angle, SETTINGS.diagnostics)
    assert finding.facts["origin"] == "the motion"
    assert sensors.computed_torque(an_epoch(), SETTINGS.diagnostics) == []
    virtual = replace(of_angle, virtual=True)
    assert sensors.computed_torque(virtual, SETTINGS.diagnostics) == []


# --- the subject's own torque -------------------------------------------------------------------


def test_a_relaxed_joint_shows_no_torque_of_its_own():
    assert moved(an_epoch()) == {}
    assert moved(an_epoch(push=lambda t: 0.01 * (t - 10.0))) == {}


def test_a_push_is_found_with_its_power_and_its_seconds():
    """0.3 N·m at 1.1 Hz, in the second half alone."""
    push = lambda t: np.where(t >= 10.0, sine(1.1, 0.3)(t), 0.0)  # noqa: E731
    epoch = an_epoch(push=push)
    told = moved(epoch)
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
    told = moved(an_epoch(rate_hz, push=sine(7.4, 0.1), **channels))
    assert told.keys() == {"tremor"}
    facts = told["tremor"].facts
    assert facts["frequency_hz"] == pytest.approx(7.4, abs=0.03)
    assert facts["amplitude_nm"] == pytest.approx(0.1, rel=0.05)


def test_what_the_loop_makes_of_a_push_decides_the_level():
    epoch = an_epoch(push=sine(1.1, 0.3))
    bias = np.array([0.0, 0.0, 0.01])
    for pull, level, variant in (
        (Pull(instruments=True), "note", "instrument"),
        (Pull(0.05 * bias), "note", "small_bias"),
        (Pull(bias, in_interval=True), "note", "in_interval"),
        (Pull(100 * bias, in_interval=True), "caution", None),
        (Pull(np.full(3, np.nan)), "caution", None),
    ):
        finding = moved(epoch, pull)["voluntary_torque"]
        assert (finding.level, finding.facts.get("variant")) == (level, variant)


def test_a_level_of_the_settings_stands_whatever_is_harmless():
    strict = SETTINGS.diagnostics.levels.model_copy(update={"tremor": "exclude"})
    checks = SETTINGS.diagnostics.model_copy(update={"levels": strict})
    assert found("tremor", checks, 5.0, harmless="instrument").level == "exclude"


# --- muscles ------------------------------------------------------------------------------------


def test_bursts_close_together_are_one_and_short_ones_none():
    time_s = np.arange(0.0, 10.0, 0.01)
    values = np.ones(time_s.size)
    for start_s, stop_s in ((1.0, 1.5), (1.6, 2.0), (4.0, 4.1), (6.0, 7.0)):
        values[(time_s >= start_s) & (time_s < stop_s)] = 10.0
    spans = bursts(Channel("emg_v", time_s, values), 1.0, SETTINGS.diagnostics)
    assert np.ravel(spans) == pytest.approx([1.0, 1.99, 6.0, 6.99], abs=1e-6)
    assert joined([(3.0, 4.0), (1.0, 2.0), (1.5, 3.5)]) == [(1.0, 4.0)]


def test_an_envelope_of_the_stretch_follows_the_motion_and_one_of_chance_does_not():
    epoch, late_s = an_epoch(), 0.06
    velocity = epoch.channels["velocity_rad_s"]
    time_s = velocity.time_s[::5]
    stretched = np.maximum(np.interp(time_s - late_s, velocity.time_s, velocity.values), 0.0)
    noise = np.abs(np.random.default_rng(3).standard_normal(time_s.size))
    assert follows_motion(Channel("emg_v", time_s, stretched + 0.1 * noise), epoch)
    assert not follows_motion(Channel("emg_v", time_s, noise), epoch)
