"""Epochs of a virtual subject who pushes now and then, with the virtual EMG of two muscles."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import EmgSettings, Settings, parse_settings
from rigidimeter.model import JointDynamics, VirtualEmg
from rigidimeter.planning import prbs_nm
from rigidimeter.virtual.batch import bench, draw_inputs, epoch_generator, simulate_inputs

Array = NDArray[np.float64]
JOINT = JointDynamics(0.0045, 0.1368, 1.751)
EMG = EmgSettings(source="virtual", muscles=["biceps", "triceps"])
FADE_S = 0.05
"""A burst begins and ends within this time."""


class Pushed(NamedTuple):
    """An epoch, and from when to when muscles were active in it, in s."""

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
            active_s = start_s - EMG.virtual_delay_s
            own.append((active_s, active_s + long_s))
        inputs.append(replace(drawn, voluntary_nm=drawn.voluntary_nm * gate))
        spans.append(own)
    batch = simulate_inputs(rig, perturbation, inputs, conditions=["OFF"] * n)
    found = []
    for i, (drawn, own) in enumerate(zip(inputs, spans, strict=True)):
        rng = np.random.default_rng([seed, i])
        epoch = with_emg(batch.epoch(i), time_s, drawn.voluntary_nm, rng)
        found.append(Pushed(epoch, own))
    return settings, found


def with_emg(epoch: Epoch, time_s: Array, torque_nm: Array, rng: np.random.Generator) -> Epoch:
    """Return an epoch with the EMG of muscles that give this torque at these times."""
    emg_v = VirtualEmg(EMG, rng).until(time_s - time_s[0], torque_nm)
    at_s = time_s[0] + np.arange(len(emg_v)) / EMG.rate_hz
    channels = {
        name: Channel(name, at_s, one) for name, one in zip(EMG.channels, emg_v.T, strict=True)
    }
    return replace(epoch, channels={**epoch.channels, **channels})


def with_reflex_emg(
    epoch: Epoch, nm_s_rad: float, delay_s: float, rng: np.random.Generator
) -> Epoch:
    """Return an epoch with the EMG of muscles whose torque opposes the velocity so much later."""
    velocity = epoch.channels["velocity_rad_s"]
    late = np.interp(velocity.time_s - delay_s, velocity.time_s, velocity.values)
    return with_emg(epoch, velocity.time_s, -nm_s_rad * late, rng)
