"""A set-up of limb, rig and subject becomes the epochs of a recording, with the truth of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter
from tests.scenarios.motion import ADDED, COURSE_HZ, DAMPING, FINE_HZ, STIFFNESS, run
from tests.scenarios.perturbations import Perturbation, perturbation_nm
from tests.scenarios.plant import TORQUE_MOTOR, Controller, Drive, Joint, TorquePath
from tests.scenarios.sensors import Sensor, kept, newest, recorded, stamp_errors_s, taken
from tests.scenarios.subject import Subject, courses

from rigidimeter.core.records import Channel, Epoch, Ticks

Array = NDArray[np.float64]
MEASURED = ("torque_nm", "angle_rad", "velocity_rad_s")


@dataclass(frozen=True)
class Setup:
    """What really is, which the settings of the analysis need not know.

    `velocity` says whether the velocity is recorded beside the angle.
    """

    joint: Joint
    controller: Controller
    drive: Drive
    path: TorquePath
    torque: Sensor
    motion: Sensor
    perturbation: Perturbation
    subject: Subject
    velocity: bool = True


class Simulated(NamedTuple):
    """Epochs and what their J, B and K were, shape (epochs, 3): means where they changed."""

    epochs: list[Epoch]
    truth: Array


def simulate(setup: Setup, n_epochs: int, seed: np.random.SeedSequence) -> Simulated:
    """Simulate the epochs of one recording."""
    both = [
        _epoch(setup, number, np.random.default_rng(child))
        for number, child in enumerate(seed.spawn(n_epochs))
    ]
    return Simulated([epoch for epoch, _ in both], np.array([truth for _, truth in both]))


def measured_alone(epoch: Epoch) -> Epoch:
    """Return the epoch as a file of torque and motion holds it: no perturbation, no command."""
    channels = {k: epoch.channels[k] for k in MEASURED if k in epoch.channels}
    return Epoch(epoch.source, epoch.label, channels, epoch.condition, epoch.task)


def _epoch(setup: Setup, number: int, rng: np.random.Generator) -> tuple[Epoch, Array]:
    asked, tick_rate_hz = setup.perturbation, setup.controller.tick_rate_hz
    perturbation = perturbation_nm(asked, tick_rate_hz)
    ticks = perturbation.size
    course = courses(setup.subject, asked.duration_s, number, rng)
    torque_steps = taken(setup.torque, asked.duration_s, rng)
    which = newest(torque_steps, setup.torque, tick_rate_hz, ticks)
    at_ms = np.arange(course.shape[1]) / COURSE_HZ
    added = setup.torque.noise * rng.standard_normal(torque_steps.size)
    added += np.interp(torque_steps / FINE_HZ, at_ms, course[ADDED])
    runs = ticks_run(setup.controller, ticks, rng)
    tools = setup.subject.tool_kg_m2
    inertia_kg_m2 = setup.joint.inertia_kg_m2 + tools[number % len(tools)]
    joint = setup.joint._replace(inertia_kg_m2=inertia_kg_m2)
    angle, velocity, torque, command = run(
        joint,
        setup.drive,
        setup.path,
        setup.controller,
        course,
        perturbation,
        np.where(which >= 0, torque_steps[which], -1),
        added[which],
        runs,
    )
    channels = [
        _channel("torque_nm", torque[torque_steps] + added, torque_steps, setup.torque, rng)
    ]
    channels += _motion(setup, angle, velocity, rng)
    ran = runs >= 0
    late_by = runs / FINE_HZ * tick_rate_hz - np.arange(ticks)
    late = ran & ((late_by > 0.5) | ~np.roll(ran, 1))
    tick_s = runs[ran] / FINE_HZ
    if setup.drive.kind != TORQUE_MOTOR:
        channels.append(Channel("velocity_command_rad_s", tick_s, command[ran]))
    channels.append(Channel("perturbation_nm", tick_s, perturbation[ran]))
    epoch = Epoch(
        source="simulated elsewhere",
        label=str(number),
        channels={channel.name: channel for channel in channels},
        condition="OFF",
        task="prbs",
        excitation_hz=asked.band_hz,
        virtual=True,
        ticks=Ticks(int(np.sum(ran)), int(np.sum(late)), int(np.sum(~ran))),
    )
    J, B, K = joint[:3]
    return epoch, np.array([J, B * course[DAMPING].mean(), K * course[STIFFNESS].mean()])


def ticks_run(controller: Controller, ticks: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return the fine step at which each tick runs, −1 where it is missed."""
    ratio = round(FINE_HZ / controller.tick_rate_hz)
    runs = np.arange(ticks) * ratio
    if not controller.late:
        return runs
    late = rng.exponential(controller.late_s * FINE_HZ, ticks).astype(np.int64)
    late[rng.random(ticks) >= controller.late] = 0
    for tick in np.flatnonzero(late):
        # A tick that is late by whole ticks runs as the last of those that are due by then.
        runs_as = min(tick + late[tick] // ratio, ticks - 1)
        if runs[tick] >= 0:
            at = min(tick * ratio + late[tick], (runs_as + 1) * ratio - 1)
            runs[tick:runs_as], runs[runs_as] = -1, at
    return runs


def _channel(
    name: str, values: Array, steps: NDArray[np.int64], sensor: Sensor, rng: np.random.Generator
) -> Channel:
    keep, errors = kept(sensor, steps.size, rng), stamp_errors_s(sensor, steps.size, rng)
    return recorded(name, values, steps, sensor, sensor.step, keep, errors)


def _motion(setup: Setup, angle: Array, velocity: Array, rng: np.random.Generator) -> list[Channel]:
    sensor = setup.motion
    steps = taken(sensor, setup.perturbation.duration_s, rng)
    keep, errors = kept(sensor, steps.size, rng), stamp_errors_s(sensor, steps.size, rng)
    sampled_rad, sampled_rad_s = angle[steps], velocity[steps]
    if sensor.noise:
        sampled_rad = sampled_rad + sensor.noise * rng.standard_normal(steps.size)
    if sensor.rate_lowpass_hz:
        filtered = lfilter(*butter(2, sensor.rate_lowpass_hz, fs=FINE_HZ), velocity)
        sampled_rad_s = np.asarray(filtered)[steps]
    if sensor.rate_differenced:
        counted = np.round(sampled_rad / sensor.step) * sensor.step
        sampled_rad_s = np.diff(counted, prepend=counted[0]) * sensor.rate_hz
    both = [
        ("angle_rad", sampled_rad, sensor.step),
        ("velocity_rad_s", sampled_rad_s, sensor.rate_step),
    ]
    return [
        recorded(name, values, steps, sensor, step, keep, errors)
        for name, values, step in both[: 2 if setup.velocity else 1]
    ]
