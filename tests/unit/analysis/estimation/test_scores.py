"""A sinusoid has both scores in closed form: work π B ω A², and an impulse from the amplitude."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import (
    find_motion,
    score_epoch,
    scoring_cycles,
)
from rigidimeter.analysis.estimation.scores import line_shares
from rigidimeter.analysis.estimation.stretches import longest_part
from rigidimeter.core.records import Channel, Epoch, LeftOut, Motion, Outcome
from rigidimeter.core.settings import EstimationSettings, ScoreSettings
from rigidimeter.model import JointDynamics

A, F = math.radians(20.0), 1.0
W = 2 * math.pi * F
SCORES, SCREEN = ScoreSettings(), EstimationSettings()


def motion(t):
    return A * np.sin(W * t), A * W * np.cos(W * t), -A * W**2 * np.sin(W * t)


def sinusoid_epoch(joint, rate_hz=1000.0, duration_s=20.0, delay_s=0.0, known=True):
    t = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    channels = {
        "torque_nm": Channel("torque_nm", t, joint.torque_nm(*motion(t - delay_s))),
        "angle_rad": Channel("angle_rad", t, motion(t)[0]),
    }
    said = Motion(F, 0.0, duration_s) if known else None
    return Epoch("file", "1", channels, task="sinusoid", motion=said)


@pytest.mark.parametrize("rate_hz", [100.0, 1000.0])
def test_the_work_score_of_a_recording_is_the_closed_form(rate_hz):
    expected = math.pi * 0.1368 * W * A**2
    soft = score_epoch(
        sinusoid_epoch(JointDynamics(0.0045, 0.1368, 1.751), rate_hz), SCORES, SCREEN
    )
    hard = score_epoch(
        sinusoid_epoch(JointDynamics(0.0045, 0.1368, 3.064), rate_hz), SCORES, SCREEN
    )
    assert soft.n_cycles == 8
    assert soft.work_j == pytest.approx(expected, rel=1e-6)
    assert hard.work_j == pytest.approx(soft.work_j, rel=1e-9)


def test_the_impulse_score_of_a_recording_is_the_closed_form():
    # Σ|M|Δt over a cycle of amplitude C is 4 C / ω.
    joint = JointDynamics(0.0045, 0.1368, 1.751)
    amplitude = A * math.hypot(1.751 - 0.0045 * W**2, 0.1368 * W)
    score = score_epoch(sinusoid_epoch(joint), SCORES, SCREEN)
    assert score.impulse_nm_s == pytest.approx(4 * amplitude / W, rel=1e-5)


def test_a_delay_between_torque_and_angle_makes_work_depend_on_stiffness():
    # −K A² π sin(ωτ): a torque that is 10 ms late makes a stiff joint seem to give work back.
    late = [
        score_epoch(sinusoid_epoch(JointDynamics(1e-9, 1e-6, k), delay_s=0.01), SCORES, SCREEN)
        for k in (1.0, 2.0)
    ]
    for k, score in zip((1.0, 2.0), late, strict=True):
        assert score.work_j == pytest.approx(-math.pi * k * A**2 * math.sin(0.01 * W), rel=5e-3)


def test_the_motion_is_found_where_it_is_not_said():
    t = np.arange(20_001) / 1000.0
    moving = (t >= 3.0) & (t <= 13.0)
    angle = np.where(moving, A * np.sin(2 * np.pi * 1.1 * (t - 3.0)), 0.0)
    channels = {
        "torque_nm": Channel("torque_nm", t, angle + 0.1),
        "angle_rad": Channel("angle_rad", t, angle),
    }
    epoch = Epoch("file", "1", channels)
    found = find_motion(epoch)
    assert found.frequency_hz == pytest.approx(1.1, abs=0.005)
    assert found.start_s == pytest.approx(3.0, abs=0.3)
    assert found.start_s + found.duration_s == pytest.approx(13.0, abs=0.3)
    assert line_shares(epoch).angle > 0.9


@pytest.mark.parametrize("ramp", [0.05, 0.08, 0.12])
def test_steps_to_and_fro_are_no_sinusoid(ramp):
    """The first line of a trapezoid whose ramps take r of the period, and of its two pulses."""
    t = np.arange(20_000) / 1000.0
    there = np.clip((t % 2.0) / 2.0 / ramp, 0, 1) - np.clip(((t % 2.0) / 2.0 - 0.5) / ramp, 0, 1)
    shares = line_shares(Epoch("file", "1", {"angle_rad": Channel("angle_rad", t, there)}))
    power = 8 / np.pi**2 * np.sinc(ramp) ** 2 / (1 - 4 * ramp / 3)
    assert shares.angle == pytest.approx(power, abs=0.005)
    assert shares.velocity == pytest.approx(4 * ramp * np.sinc(ramp) ** 2, abs=0.05)
    assert not shares.single(0.7)


def test_a_sinusoid_with_a_tremor_upon_it_is_one():
    t = np.arange(20_000) / 1000.0
    angle = 0.1 * np.sin(2 * np.pi * 1.1 * t) + 0.01 * np.sin(2 * np.pi * 5.0 * t)
    shares = line_shares(Epoch("file", "1", {"angle_rad": Channel("angle_rad", t, angle)}))
    assert shares.velocity == pytest.approx(1 / (1 + (0.1 * 5.0 / 1.1) ** 2), abs=0.01)
    assert shares.single(0.85)


@pytest.mark.parametrize("seed", range(8))
def test_a_drifting_angle_is_no_sinusoid(seed):
    t = np.arange(2000) / 100.0
    angle = np.cumsum(np.random.default_rng(seed).standard_normal(2000)) * 0.001
    epoch = Epoch("file", "1", {"angle_rad": Channel("angle_rad", t, angle)})
    assert line_shares(epoch).angle < 0.7


def test_a_short_motion_gives_the_cycles_it_has_or_says_that_it_has_none():
    joint = JointDynamics(0.0045, 0.1368, 1.751)
    assert scoring_cycles(sinusoid_epoch(joint, duration_s=6.0), SCORES).n_cycles == 4
    epoch = sinusoid_epoch(joint)
    short = Epoch("f", "1", epoch.channels, task="sinusoid", motion=Motion(F, 0.0, 2.5))
    score = score_epoch(short, SCORES, SCREEN)
    assert score.outcome.kind == "failed"
    assert "no whole cycle" in score.outcome.reason
    assert math.isnan(score.work_j)


def test_an_epoch_that_was_not_closed_with_success_is_scored_but_does_not_count():
    epoch = sinusoid_epoch(JointDynamics(0.0045, 0.1368, 1.751))
    touched = Epoch("f", "1", epoch.channels, motion=epoch.motion,
                    closed=Outcome("excluded", "limit"))  # fmt: skip
    score = score_epoch(touched, SCORES, SCREEN)
    assert score.outcome == Outcome("excluded", "limit")
    assert math.isfinite(score.work_j)


def test_a_recording_too_slow_for_its_motion_is_not_scored():
    epoch = sinusoid_epoch(JointDynamics(0.0045, 0.1368, 1.751), rate_hz=4.0)
    score = score_epoch(epoch, SCORES, SCREEN)
    assert score.outcome.kind == "failed"
    assert "was sampled at 4 Hz; a 1 Hz motion needs 10 Hz" in score.outcome.reason


@pytest.mark.parametrize("frequency_hz", [0.5, 2.0, 3.0])
def test_the_scores_hold_at_other_frequencies_than_the_papers(frequency_hz):
    t = np.arange(20_001) / 1000.0
    w = 2 * math.pi * frequency_hz
    x, v = A * np.sin(w * t), A * w * np.cos(w * t)
    channels = {
        "torque_nm": Channel("torque_nm", t, 0.1368 * v + 1.751 * x),
        "angle_rad": Channel("angle_rad", t, x),
    }
    motion = Motion(frequency_hz, 0.0, 20.0)
    score = score_epoch(Epoch("f", "1", channels, motion=motion), SCORES, SCREEN)
    assert score.work_j == pytest.approx(math.pi * 0.1368 * w * A**2, rel=1e-4)
    fast = Motion(9.0, 0.0, 20.0)
    outside = score_epoch(Epoch("f", "1", channels, motion=fast), SCORES, SCREEN)
    assert "outside the band of the scores" in outside.outcome.reason


def test_what_is_left_out_of_a_motion_leaves_its_longest_part():
    """Motion for 10 s and a rest of 10 s, with a hole at 9 s: most of the motion is before it."""
    joint = JointDynamics(0.0045, 0.1368, 1.751)
    t = np.arange(20_001) / 1000.0
    there = [np.where(t <= 10.0, part, 0.0) for part in motion(t)]
    channels = {
        "torque_nm": Channel("torque_nm", t, joint.torque_nm(*there)),
        "angle_rad": Channel("angle_rad", t, there[0]),
    }
    said = Motion(F, 0.0, 10.0)
    whole = Epoch("file", "1", channels, task="sinusoid", motion=said)
    part = longest_part(replace(whole, left_out=(LeftOut(9.0, 9.1),)))
    assert part.channels["angle_rad"].time_s[-1] == pytest.approx(9.0, abs=2e-3)
    score = score_epoch(part, SCORES, SCREEN)
    assert score.n_cycles == 7  # of the 8 that the whole has
    assert score.work_j == pytest.approx(math.pi * 0.1368 * W * A**2, rel=0.01)
