"""A joint that varies within an epoch is found, with what it varies with, and how far it goes."""

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import fit_epochs
from rigidimeter.analysis.estimation.closedloop.grid import Grid
from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.diagnostics.varying_lines import VaryingLines
from rigidimeter.analysis.estimation.diagnostics.varying_shapes import imposed_period_s
from rigidimeter.analysis.estimation.diagnostics.varying_test import Columns, score_test
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

JOINT = JointDynamics(0.0045, 0.1368, 1.751)
K = JOINT.stiffness_nm_rad
VARYING = {"varying_with_time", "varying_with_angle", "varying_with_phase"}
RATE_HZ = 100.0


def stationary(voluntary_sd_nm):
    """Return settings and an epoch of a joint that stays the same."""
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": voluntary_sd_nm}}})
    batch = simulate_epochs(settings, 1, joints=[JOINT], conditions="OFF", seed=4)
    return settings, batch.epoch(0)


@pytest.fixture(scope="module")
def relaxed():
    return stationary(0.02)


def varying_findings(settings, epoch, method):
    (fit,), _ = fit_epochs([epoch], method, settings)
    (prepared,) = prepare([epoch], settings)
    return {f.name: f for f in checked(prepared, fit).findings if f.name in VARYING}


def with_torque(epoch, more_nm):
    """Return the epoch with more torque: M of a joint that varies, at the motion that was."""
    torque, angle = (epoch.channels[name] for name in ("torque_nm", "angle_rad"))
    changed = torque.values + more_nm(torque.time_s - torque.time_s[0], angle.values)
    channel = Channel("torque_nm", torque.time_s, changed)
    return replace(epoch, channels={**epoch.channels, "torque_nm": channel})


def open_loop(stiffness_nm_rad, movement_rad=0.0, period_s=2.0, seed=0):
    """Return an imposed motion, fast about a slow movement, and the torque in closed form.

    The slow movement has a torque of its own, which no stiffness about it explains.
    """
    t = np.arange(2000) / RATE_HZ
    rng = np.random.default_rng(seed)
    phase = 2 * np.pi * t / period_s
    angle, velocity, acceleration = np.zeros((3, t.size))
    for frequency_hz in np.arange(0.7, 12.0, 0.35):
        omega = 2 * np.pi * frequency_hz
        at = omega * t + rng.uniform(0, 2 * np.pi)
        angle += 0.003 * np.sin(at)
        velocity += 0.003 * omega * np.cos(at)
        acceleration -= 0.003 * omega**2 * np.sin(at)
    fast = 0.015 * acceleration + 0.8 * velocity + stiffness_nm_rad(t, phase) * angle
    slow = 2.0 * np.sin(phase + 1) + 0.5 * np.sin(2 * phase) if movement_rad else 0.0
    torque = fast + slow + 0.02 * rng.standard_normal(t.size)
    channels = {
        "torque_nm": torque,
        "angle_rad": angle + movement_rad * np.cos(phase),
        "velocity_rad_s": velocity - movement_rad * 2 * np.pi / period_s * np.sin(phase),
    }
    return Epoch("a", "1", {n: Channel(n, t, v) for n, v in channels.items()}, task="prbs")


@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.2])
def test_a_stationary_joint_varies_with_nothing_whatever_its_owner_does(voluntary_sd_nm):
    settings, epoch = stationary(voluntary_sd_nm)
    assert varying_findings(settings, epoch, "iv") == {}
    assert varying_findings(settings, epoch, "bandlimited") == {}


def test_a_stiffness_that_rises_by_half_is_found_with_both_its_ends(relaxed):
    settings, epoch = relaxed
    stepping = with_torque(epoch, lambda t, angle: 0.5 * K * (t > 10) * angle)
    found = varying_findings(settings, stepping, "iv")
    assert found.keys() == {"varying_with_time"}
    finding = found["varying_with_time"]
    assert finding.level == "caution"
    assert finding.value == pytest.approx(40.0, abs=15.0)
    assert finding.limit == 10.0
    assert (finding.facts["symbol"], finding.facts["size_unit"]) == ("K", "N·m/rad")
    assert 1.5 < finding.facts["low"] < 2.0 < finding.facts["high"] < 3.0
    assert finding.p < 0.005


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
def test_a_stiffness_that_changes_with_the_angle_is_found(relaxed, method):
    settings, epoch = relaxed
    # The slope of the torque goes from 0.6 to 1.4 of K over ±10 deg.
    curved = with_torque(epoch, lambda t, angle: K * 0.4 / np.radians(10) * angle**2 / 2)
    found = varying_findings(settings, curved, method)
    assert found.keys() == {"varying_with_angle"}
    assert found["varying_with_angle"].facts["high_at"].endswith("° from the mean")


def test_damping_that_drifts_is_not_called_stiffness(relaxed):
    settings, epoch = relaxed

    def more_nm(t, angle):
        velocity = epoch.channels["velocity_rad_s"].values
        return 0.3 * JOINT.damping_nm_s_rad * (t / 10 - 1) * velocity

    found = varying_findings(settings, with_torque(epoch, more_nm), "iv")
    assert found.keys() == {"varying_with_time"}
    facts = found["varying_with_time"].facts
    assert (facts["symbol"], facts["others"]) == ("B", "")


def test_a_change_below_the_share_that_is_set_is_no_finding(relaxed):
    settings, epoch = relaxed
    drifting = with_torque(epoch, lambda t, angle: 0.25 * K * (t / 10 - 1) * angle)
    assert varying_findings(settings, drifting, "iv").keys() == {"varying_with_time"}
    lax = settings.model_copy(
        update={"diagnostics": settings.diagnostics.model_copy(update={"max_varying_percent": 80})}
    )
    assert varying_findings(lax, drifting, "iv") == {}


def test_a_stiffness_that_follows_the_phase_of_a_movement_is_found_from_end_to_end():
    epoch = open_loop(lambda t, phase: 40.5 + 22.5 * np.cos(phase), movement_rad=0.15)
    found = varying_findings(Settings(), epoch, "bandlimited")
    assert found.keys() == {"varying_with_phase"}
    facts = found["varying_with_phase"].facts
    assert facts["symbol"] == "K"
    assert (facts["low"], facts["high"]) == pytest.approx((18.0, 63.0), abs=1.0)
    assert facts["high_at"].endswith("of the 2 s cycle")


@pytest.mark.parametrize("movement_rad", [0.0, 0.15])
def test_a_movement_with_its_own_torque_is_no_stiffness_that_varies(movement_rad):
    epoch = open_loop(lambda t, phase: 40.5, movement_rad=movement_rad)
    assert varying_findings(Settings(), epoch, "bandlimited") == {}


def lines_of(torque, motion, n=600, rate_hz=30.0):
    """Return lines without a window, of white signals."""
    line = np.arange(1, 256)
    grid = Grid(
        np.arange(n) / rate_hz, rate_hz, np.ones(n), np.zeros(n), np.zeros(n), line,
        2 * np.pi * line * rate_hz / n, float(n), np.zeros(line.size, complex),
    )  # fmt: skip
    spectra = np.fft.rfft(motion, axis=0)[1:256]
    return VaryingLines(
        grid, np.fft.rfft(torque)[1:256], spectra, spectra, np.ones(255), motion[:, 2], True
    )


@pytest.mark.parametrize("burst", [1.0, 6.0])
def test_the_level_holds_for_noise_that_comes_in_bursts(burst):
    rng = np.random.default_rng(8)
    draws, n = 400, 600
    slow = np.stack([np.linspace(-1, 1, n), np.linspace(-1, 1, n) ** 2 - 1 / 3], axis=1)
    rejected = 0
    for _ in range(draws):
        motion = rng.standard_normal((n, 3))
        loud = np.repeat(np.where(rng.random(20) < 0.3, burst, 1.0), n // 20)
        lines = lines_of(motion.sum(1) + loud * rng.standard_normal(n), motion)
        base = lines.whitened(lines.motion)
        tested = lines.whitened(lines.in_band(lines.in_time(lines.motion)[:, [2]] * slow))
        score = score_test(
            lines, lines.whitened(lines.torque_nm), Columns(base, base), Columns(tested, tested)
        )
        rejected += score.p < 0.05
    # 400 draws at 5 %: 99 % of counts lie from 10 to 32.
    assert 8 <= rejected <= 32


def test_the_period_of_a_movement_is_found_and_a_perturbation_has_none():
    t = np.arange(600) / 30.0
    rng = np.random.default_rng(1)
    motion = 0.1 * rng.standard_normal((600, 3))
    motion[:, 2] += np.cos(2 * np.pi * t / 2.5)
    assert imposed_period_s(lines_of(motion[:, 2], motion)) is None  # it is the perturbation's
    moved = replace(lines_of(motion[:, 2], motion), by_perturbation=False)
    assert imposed_period_s(moved) == pytest.approx(2.5, rel=0.01)
    random = 0.1 * rng.standard_normal((600, 3))
    none = replace(lines_of(random[:, 2], random), by_perturbation=False)
    assert imposed_period_s(none) is None
