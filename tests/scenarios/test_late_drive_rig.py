"""J, B and K where command and angle alone show the drive, or nothing does, and with a tachometer.

`python -m benchmarks.late_drive` measures the same on 400 epochs a row.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.scenarios.late_drive_rig import LateRig, simulate

import rigidimeter
from rigidimeter.analysis.recording import estimate
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import parse_settings

ALWAYS = ("torque_nm", "angle_rad", "perturbation_nm")
COMMAND, BOTH = ("velocity_command_rad_s",), ("velocity_command_rad_s", "velocity_rad_s")
FIRST_ORDER = LateRig(order=1, drive_hz=26.5, late_s=0.0, tick_hz=500.0)
"""Of 6 ms: the torque at a tick sees 0.84 of the mean acceleration."""
SUBJECTS = [(limb, pushing) for limb in ("human", "small") for pushing in (False, True)]


def recorded(rig: LateRig, more: tuple[str, ...], epochs: int = 4) -> list[Epoch]:
    return [
        replace(one, channels={name: one.channels[name] for name in (*ALWAYS, *more)})
        for one in simulate(rig, 1, epochs)
    ]


def fits_of(rig: LateRig, more: tuple[str, ...], epochs: int = 4):
    return estimate(recorded(rig, more, epochs), "iv", settings=parse_settings(rig.settings())).fits


def names_of(fit) -> set[str]:
    return {one.name for one in fit.findings}


def test_a_drive_of_first_order_is_followed_exactly():
    """v(k + 1) = e v(k) + (1 - e) c(k), e = exp(-ωT), and M sees the acceleration ω (c - v)."""
    rig = replace(
        FIRST_ORDER,
        torque_noise_nm=0.0,
        coloured_nm=0.0,
        tachometer_rad_s=0.0,
        encoder_counts=2**40,
    )
    (epoch,) = simulate(rig, 1, 1, 2.0)
    torque, angle, velocity, command = (
        epoch.channels[name].values
        for name in ("torque_nm", "angle_rad", "velocity_rad_s", "velocity_command_rad_s")
    )
    omega = 2 * np.pi * rig.drive_hz
    decay = np.exp(-omega / rig.tick_hz)
    assert velocity[1:] == pytest.approx(decay * velocity[:-1] + (1 - decay) * command[:-1])
    acceleration = omega * (command[:-1] - velocity[1:])
    moved = np.stack([acceleration, velocity[1:], angle[1:]])
    assert torque[1:] == pytest.approx(rig.truth @ moved, abs=1e-9)


def test_a_late_command_acts_after_its_delay():
    """A held command c from rest: v = c (1 - e^(-σt) (cos ω_d t + σ/ω_d sin ω_d t))."""
    rig = replace(LateRig(), tachometer_rad_s=0.0, torque_noise_nm=0.0, coloured_nm=0.0)
    (epoch,) = simulate(rig, 1, 1, 0.5)
    command = epoch.channels["velocity_command_rad_s"].values
    omega, ratio = 2 * np.pi * rig.drive_hz, rig.damping_ratio
    sigma, damped = ratio * omega, omega * np.sqrt(1 - ratio**2)
    steps, time_s = np.diff(command, prepend=0.0), epoch.channels["angle_rad"].time_s
    since_s = np.maximum(time_s[:, None] - time_s - rig.late_s, 0.0)
    turning = np.cos(damped * since_s) + sigma / damped * np.sin(damped * since_s)
    answer = 1 - np.exp(-sigma * since_s) * turning
    assert epoch.channels["velocity_rad_s"].values == pytest.approx(answer @ steps, abs=1e-9)


@pytest.mark.parametrize("pushing", [False, True])
def test_command_and_angle_are_enough_to_know_the_drive(pushing):
    rig = replace(FIRST_ORDER, pushing=pushing)
    for fit in fits_of(rig, COMMAND):
        assert fit.low[0] <= rig.truth[0] <= fit.high[0]
        assert "between_samples" not in names_of(fit)
        if not pushing:
            assert fit.inertia_kg_m2 == pytest.approx(rig.truth[0], rel=0.003)


@pytest.mark.parametrize("pushing", [False, True])
def test_a_drive_that_is_not_known_is_said_with_the_range_of_J(pushing):
    rig = replace(FIRST_ORDER, pushing=pushing)
    analysis = estimate(recorded(rig, ()), "iv", settings=parse_settings(rig.settings()))
    for fit in (*analysis.fits, *analysis.pooled):
        assert fit.inertia_kg_m2 < 0.9 * rig.truth[0]
        (finding,) = (one for one in fit.findings if one.name == "between_samples")
        assert finding.level == "caution"
        assert finding.facts["low_j"] <= rig.truth[0] <= finding.facts["high_j"]
        assert f"{finding.facts['high_j']:.3g} kg·m²" in finding.headline
        assert finding.headline in fit._repr_html_()
    assert finding.headline in analysis._repr_html_()


def test_torque_that_is_not_late_rules_out_a_drive_that_jumps():
    """Of second order and 50 Hz at 1000 ticks/s: 0.8 % at most, which the interval holds."""
    rig = replace(LateRig(), late_s=0.0)
    for fit in fits_of(rig, ()):
        assert "between_samples" not in names_of(fit)
        assert fit.low[0] <= rig.truth[0] <= fit.high[0]


@pytest.mark.parametrize(("limb", "pushing"), SUBJECTS)
def test_the_command_makes_no_interval_wider(limb, pushing):
    rig = LateRig(limb, pushing)
    half = {}
    for more in ((), COMMAND, BOTH):
        fits = fits_of(rig, more, 6)
        assert all("between_samples" not in names_of(fit) for fit in fits)
        half[more] = np.median([fit.high - fit.low for fit in fits], axis=0)
    assert np.all(half[COMMAND] < 1.1 * half[()])
    assert np.all(half[BOTH] < 1.1 * half[()])


def test_a_noisy_velocity_gives_way_to_the_angle():
    """It alone leaves 0.13 ms of delay open, and with that 2 % of J."""
    epochs = recorded(FIRST_ORDER, BOTH, 1)
    blind = [
        replace(one, channels={k: v for k, v in one.channels.items() if k != "angle_rad"})
        for one in epochs
    ]
    settings = parse_settings(FIRST_ORDER.settings())
    both, alone = (estimate(some, "iv", settings=settings).fits[0] for some in (epochs, blind))
    assert both.high[0] - both.low[0] < 0.3 * (alone.high[0] - alone.low[0])
    assert both.low[0] <= FIRST_ORDER.truth[0] <= both.high[0]


def test_no_delay_within_a_tick_is_made_of_a_drive_that_jumps():
    """Torque late by τ < T is that of J e^(-ωτ): recording 4 had 1.9 ms, and J 25 % low."""
    for recording in (1, 4):
        (epoch,) = simulate(FIRST_ORDER, recording, 1)
        part = {name: epoch.channels[name] for name in (*ALWAYS, *COMMAND)}
        analysis = estimate([replace(epoch, channels=part)], "iv")
        assert not analysis.delays[0].corrected
        assert analysis.fits[0].inertia_kg_m2 == pytest.approx(FIRST_ORDER.truth[0], rel=0.01)


def test_a_notebook_shows_what_the_caution_says():
    (epoch,) = recorded(FIRST_ORDER, (), 1)
    arrays = {name: channel.values for name, channel in epoch.channels.items()}
    fit = rigidimeter.identify(**arrays, rate_hz=FIRST_ORDER.tick_hz)
    assert "kg·m²: the drive is not known" in fit._repr_html_()
