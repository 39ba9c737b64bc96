"""A sinusoid has both scores in closed form: work π B ω A², and an impulse from the amplitude."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import score_epoch, scoring_cycles, task_of
from rigidimeter.core.records import Channel, Epoch, Motion, Outcome
from rigidimeter.core.settings import EstimationSettings, ScoreSettings, Settings

A, JOINT = math.radians(20.0), (0.0045, 0.1368, 1.751)


def sinusoid(rate_hz=1000.0, duration_s=20.0, f=1.0, joint=JOINT, delay_s=0.0):
    t, w = np.arange(round(duration_s * rate_hz) + 1) / rate_hz, 2 * math.pi * f
    late, (J, B, K) = w * (t - delay_s), joint
    torque = (K - J * w**2) * A * np.sin(late) + B * A * w * np.cos(late)
    channels = {
        "torque_nm": Channel("torque_nm", t, torque),
        "angle_rad": Channel("angle_rad", t, A * np.sin(w * t)),
    }
    return Epoch("file", "1", channels, task="sinusoid", motion=Motion(f, 0.0, duration_s))


def scored(epoch):
    return score_epoch(epoch, ScoreSettings(), EstimationSettings())


@pytest.mark.parametrize(("rate_hz", "f"), [(100.0, 1.0), (1000.0, 1.0), (1000.0, 3.0)])
def test_the_scores_of_a_recording_are_the_closed_forms(rate_hz, f):
    w, (J, B, K) = 2 * math.pi * f, JOINT
    found = scored(sinusoid(rate_hz, f=f))
    assert found.n_cycles == 8
    assert found.work_j == pytest.approx(math.pi * B * w * A**2, rel=1e-4)
    # Σ|M|Δt over a cycle of amplitude C is 4 C / ω.
    amplitude = A * math.hypot(K - J * w**2, B * w)
    assert found.impulse_nm_s == pytest.approx(4 * amplitude / w, rel=1e-4)


def test_a_delay_makes_work_depend_on_stiffness():
    found = scored(sinusoid(joint=(1e-9, 1e-6, 2.0), delay_s=0.01))
    assert found.work_j == pytest.approx(-2 * math.pi * A**2 * math.sin(0.02 * math.pi), rel=5e-3)


def of_angle(t, x):
    """Return an epoch without a word of its task; the torque is that of a spring."""
    both = Channel("torque_nm", t, 1.751 * x), Channel("angle_rad", t, x)
    return Epoch("file", "1", {one.name: one for one in both})


def test_the_motion_is_found_where_it_is_not_said():
    t = np.arange(20_001) / 1000.0
    angle = np.where((t >= 3) & (t <= 13), A * np.sin(2 * np.pi * 1.1 * (t - 3)), 0.0)
    epoch, once = of_angle(t, angle), ScoreSettings(cycles=1000)
    found = score_epoch(epoch, once, EstimationSettings())
    assert found.frequency_hz == pytest.approx(1.1, abs=0.005)
    assert found.n_cycles == 8  # of 8.8 without the first and the last second
    assert scoring_cycles(epoch, once).time_s[0] == pytest.approx(4.0, abs=0.4)
    assert task_of(epoch, Settings()) == "sinusoid"


def test_steps_to_and_fro_are_no_sinusoid_and_one_with_a_tremor_is():
    """The line of a trapezoid holds 92 % of the angle, and 25 % of the velocity."""
    t, r = np.arange(20_000) / 1000.0, 0.08
    there = np.clip((t % 2.0) / 2.0 / r, 0, 1) - np.clip(((t % 2.0) / 2.0 - 0.5) / r, 0, 1)
    both = 0.1 * np.sin(2 * np.pi * 1.1 * t) + 0.01 * np.sin(2 * np.pi * 5.0 * t)
    tasks = [task_of(of_angle(t, x), Settings()) for x in (0.1 * there, both)]
    assert tasks == ["prbs", "sinusoid"]


@pytest.mark.parametrize(
    ("epoch", "kind", "reason"),
    [
        (sinusoid(duration_s=2.5), "failed", "at least 5 s are needed"),
        (replace(sinusoid(), motion=Motion(1.0, 0.0, 2.5)), "failed", "no whole cycle"),
        (sinusoid(4.0), "failed", "was sampled at 4 Hz; a 1 Hz motion needs 10 Hz"),
        (sinusoid(f=9.0), "failed", "outside the band of the scores"),
        (replace(sinusoid(), closed=Outcome("excluded", "limit")), "excluded", "limit"),
    ],
)
def test_what_cannot_be_scored_says_why(epoch, kind, reason):
    found = scored(epoch)
    assert found.outcome.kind == kind
    assert reason in found.outcome.reason
    assert math.isnan(found.work_j) == (kind == "failed")
