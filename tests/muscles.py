"""Epochs of a virtual subject who pushes now and then, with the EMG of two muscles."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.planning import prbs_nm
from rigidimeter.virtual.batch import bench, draw_inputs, epoch_generator, simulate_inputs

Array = NDArray[np.float64]
JOINT = JointDynamics(0.0045, 0.1368, 1.751)
EMG_RATE_HZ = 2000.0
UV_PER_NM, NOISE_UV, HUM_UV = 200.0, 4.0, 2.0
FADE_S = 0.05
"""A burst begins and ends within this time."""


class Pushed(NamedTuple):
    """An epoch, and from when to when its subject pushed, in s."""

    epoch: Epoch
    pushes: list[tuple[float, float]]


def epochs_with_emg(
    n: int,
    *,
    voluntary_nm: float = 0.0,
    tremor_nm: float = 0.0,
    pushes: int = 2,
    seed: int = 0,
    duration_s: float = 20.0,
) -> tuple[Settings, list[Pushed]]:
    """Return epochs whose subject pushes in bursts of 0.5 to 1.5 s, and their settings."""
    settings = parse_settings(
        {
            "subject": {"OFF": {"voluntary_sd_nm": voluntary_nm, "tremor_amplitude_nm": tremor_nm}},
            "protocol": {"blocks": [{"epochs": 1}]},
            "prbs": {"duration_s": duration_s},
        }
    )
    perturbation = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    rig = bench(settings, perturbation.size)
    rate_hz = settings.rig.tick_rate_hz
    time_s = np.arange(perturbation.size) / rate_hz
    inputs, spans = [], []
    for i in range(n):
        rng = epoch_generator(seed, i)
        drawn = draw_inputs(rig, settings.subject["OFF"], rng, JOINT)
        gate, own = np.zeros(time_s.size), []
        active = pushes if voluntary_nm or tremor_nm else 0
        for k in range(active):
            room_s = time_s[-1] / active
            long_s = rng.uniform(0.5, 1.5)
            start_s = room_s * k + rng.uniform(0.1, room_s - long_s - 0.1)
            edges = [start_s, start_s + FADE_S, start_s + long_s - FADE_S, start_s + long_s]
            gate = np.maximum(gate, np.interp(time_s, edges, [0, 1, 1, 0]))
            own.append((start_s, start_s + long_s))
        inputs.append(replace(drawn, voluntary_nm=drawn.voluntary_nm * gate))
        spans.append(own)
    batch = simulate_inputs(rig, perturbation, inputs, conditions=["OFF"] * n)
    found = []
    for i, (drawn, own) in enumerate(zip(inputs, spans, strict=True)):
        rng = np.random.default_rng([seed, i])
        torques = np.maximum(drawn.voluntary_nm, 0.0), np.maximum(-drawn.voluntary_nm, 0.0)
        epoch = batch.epoch(i)
        found.append(Pushed(with_emg(epoch, time_s, torques, rng), own))
    return settings, found


def with_emg(epoch: Epoch, time_s: Array, torques_nm: tuple[Array, ...], rng) -> Epoch:
    """Return an epoch with the EMG of muscles that give these torques at these times."""
    at_s = np.arange(time_s[0], time_s[-1], 1.0 / EMG_RATE_HZ)
    band = scipy.signal.butter(2, [20, 450], "bandpass", fs=EMG_RATE_HZ, output="sos")
    channels = dict(epoch.channels)
    for k, torque_nm in enumerate(torques_nm):
        noise = scipy.signal.sosfilt(band, rng.standard_normal(at_s.size))
        uv = UV_PER_NM * np.interp(at_s, time_s, torque_nm) * noise / np.std(noise)
        uv += NOISE_UV * rng.standard_normal(at_s.size)
        uv += HUM_UV * np.sin(2 * np.pi * 50 * at_s + k)
        name = "emg_v" if k == 0 else f"emg_{k + 1}_v"
        channels[name] = Channel(name, at_s, 1e-6 * uv)
    return replace(epoch, channels=channels)


def with_reflex_emg(epoch: Epoch, nm_s_rad: float, delay_s: float, rng) -> Epoch:
    """Return an epoch with the EMG of muscles that answer the velocity after a delay."""
    velocity = epoch.channels["velocity_rad_s"]
    late = np.interp(velocity.time_s - delay_s, velocity.time_s, velocity.values)
    torques = nm_s_rad * np.maximum(late, 0.0), nm_s_rad * np.maximum(-late, 0.0)
    return with_emg(epoch, velocity.time_s, torques, rng)
