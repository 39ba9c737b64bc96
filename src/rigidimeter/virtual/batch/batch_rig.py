"""The virtual rig made ready for a batch, and what is random of an epoch, drawn before it runs.

Numbers are drawn from the streams that the simulated rig draws from.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.records import readonly
from rigidimeter.core.settings import (
    MotionSensorSettings,
    Settings,
    SubjectSettings,
    TorqueSensorSettings,
)
from rigidimeter.core.units import rad_from_deg
from rigidimeter.model import (
    BLOCK_TICKS,
    SAME_TIME_S,
    Drive,
    JointDynamics,
    SubjectTorque,
    admittance,
    butterworth_lowpass,
    draw_joint,
    drive,
    rig_streams,
    sample_time_blocks_s,
)
from rigidimeter.rig.guard import guard_limits
from rigidimeter.virtual.batch.batch_epoch import BEFORE, NOW, Coefficients, Sampling
from rigidimeter.virtual.batch.compiled_steps import compiled


@dataclass(frozen=True)
class Bench:
    """A virtual rig made ready for epochs of one length.

    Parameters
    ----------
    settings : Settings
    coefficients : Coefficients
        Of controller, guard, drive and sensors.
    ticks : int
        Of each epoch.
    torque, motion : Sampling or None
        Of a sensor that keeps time, the same in every epoch; None where it jitters.
    """

    settings: Settings
    coefficients: Coefficients
    ticks: int
    torque: Sampling | None
    motion: Sampling | None

    @cached_property
    def tick_s(self) -> NDArray[np.float64]:
        """When each tick is due, in s from the first."""
        return readonly(np.arange(self.ticks) / self.settings.rig.tick_rate_hz)


def bench(settings: Settings, ticks: int) -> Bench:
    """Make the virtual rig of the settings ready for epochs of so many ticks."""
    rig, controller = settings.rig, settings.controller
    limits = guard_limits(settings)
    interval_s = limits.interval_s
    coefficients = Coefficients(
        butterworth_lowpass(controller.torque_cutoff_hz, rig.tick_rate_hz),
        admittance(controller.inertia_kg_m2, controller.damping_nm_s_rad, interval_s),
        limits,
        drive(rig.drive_bandwidth_hz, rig.drive_damping_ratio, interval_s),
        rig.tick_rate_hz,
        rig.torque.resolution_nm,
        rad_from_deg(rig.motion.angle_resolution_deg),
        rad_from_deg(rig.motion.velocity_resolution_deg_s),
    )

    def steady(sensor: TorqueSensorSettings | MotionSensorSettings) -> Sampling | None:
        if sensor.jitter_s > 0.0:
            return None
        return draw_sampling(settings, sensor, ticks, np.random.default_rng(0))

    return Bench(settings, coefficients, ticks, steady(rig.torque), steady(rig.motion))


def draw_sampling(
    settings: Settings,
    sensor: TorqueSensorSettings | MotionSensorSettings,
    ticks: int,
    rng: np.random.Generator,
) -> Sampling:
    """Draw when a sensor samples in an epoch; `rng` gives the jitter.

    The coefficients for parts of a tick hold exponentials, so they are made here, in the
    interpreter, by the function that makes them for the loop.
    """
    rig = settings.rig
    interval_s = 1.0 / rig.tick_rate_hz
    tick_s = np.arange(ticks) * interval_s
    until_s = tick_s + SAME_TIME_S
    blocks = sample_time_blocks_s(sensor.rate_hz, sensor.latency_s, sensor.jitter_s, rng)
    taken = []
    for times_s in blocks:
        taken.append(times_s)
        if times_s[-1] > until_s[-1]:
            break
    taken_s = np.concatenate(taken)
    # Samples are taken and handed over in order: none overtakes the one before.
    in_order_s = np.maximum.accumulate(taken_s)
    in_order_s = in_order_s[in_order_s <= until_s[-1]]
    taken_s = taken_s[: in_order_s.size]
    arrives_s = taken_s + sensor.latency_s

    elapsed_s, left = np.empty_like(taken_s), np.empty_like(taken_s)
    now_s = tick_s[np.searchsorted(until_s, in_order_s)]
    compiled().moments(taken_s, now_s, interval_s, elapsed_s, left)
    part = np.where(elapsed_s == interval_s, NOW, BEFORE).astype(np.int32)
    within = (elapsed_s != interval_s) & (elapsed_s != 0.0)
    lengths_s, part[within] = np.unique(elapsed_s[within], return_inverse=True)
    parts = np.empty((lengths_s.size, len(Drive._fields)))
    for row, length_s in enumerate(lengths_s.tolist()):
        parts[row] = drive(rig.drive_bandwidth_hz, rig.drive_damping_ratio, length_s)
    newest = np.searchsorted(np.maximum.accumulate(arrives_s), until_s, side="right") - 1
    n_taken = np.searchsorted(in_order_s, until_s, side="right")
    assert newest[0] >= 0  # each sensor has a sample before the first tick
    seen_s = (arrives_s - sensor.stamp_latency_s)[newest]
    return Sampling(
        _frozen_integers(n_taken, np.uint32),
        _frozen_integers(newest, np.uint32),
        readonly(seen_s),
        readonly(np.arange(ticks) / rig.tick_rate_hz - seen_s),
        _frozen_integers(part, np.int32),
        readonly(left),
        readonly(parts),
    )


def _frozen_integers(values: NDArray[Any], kind: type[np.integer[Any]]) -> NDArray[Any]:
    array = values.astype(kind)
    array.setflags(write=False)
    return array


@dataclass(frozen=True)
class EpochInputs:
    """What chance decides of one epoch.

    Parameters
    ----------
    joint : JointDynamics
    voluntary_nm : array, shape (ticks,)
        M_sub at each tick, in N·m; 0 at the first.
    noise_nm : array, shape (torque samples,)
        Added to each torque sample, in N·m.
    torque, motion : Sampling
        When the sensors sample.
    """

    joint: JointDynamics
    voluntary_nm: NDArray[np.float64]
    noise_nm: NDArray[np.float64]
    torque: Sampling
    motion: Sampling

    def __post_init__(self) -> None:
        # One layout of the arrays means one compiled form of the epoch.
        for name in ("voluntary_nm", "noise_nm"):
            values = readonly(np.ascontiguousarray(getattr(self, name), dtype=np.float64))
            object.__setattr__(self, name, values)
        ticks, samples = self.torque.taken.size, self.torque.part.size
        if self.voluntary_nm.shape != (ticks,) or self.noise_nm.shape != (samples,):
            raise ValueError(
                f"{ticks} ticks and {samples} torque samples need as many values of voluntary "
                f"torque and noise, got {self.voluntary_nm.shape} and {self.noise_nm.shape}"
            )


def draw_inputs(
    bench: Bench,
    subject: SubjectSettings,
    rng: np.random.Generator,
    joint: JointDynamics | None = None,
) -> EpochInputs:
    """Draw one epoch as a new `SimulatedRig` with the same generator would.

    Parameters
    ----------
    bench : Bench
    subject : SubjectSettings
        Voluntary torque and tremor, and the joint where none is given.
    rng : numpy.random.Generator
    joint : JointDynamics, optional
        In place of the one drawn; the other numbers stay the same.
    """
    settings = bench.settings
    rig = settings.rig
    streams = rig_streams(rng)
    torque = bench.torque or draw_sampling(settings, rig.torque, bench.ticks, streams.torque_jitter)
    motion = bench.motion or draw_sampling(settings, rig.motion, bench.ticks, streams.motion_jitter)
    return EpochInputs(
        joint or draw_joint(subject, streams.joint),
        _voluntary_nm(subject, rig.tick_rate_hz, bench.ticks, streams.subject),
        rig.torque.noise_sd_nm * streams.noise.standard_normal(torque.part.size),
        torque,
        motion,
    )


def _voluntary_nm(
    subject: SubjectSettings, rate_hz: float, ticks: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the subject's torque at each tick: none at the first, then as the subject gives it."""
    torque_nm = np.zeros(ticks)
    if subject.voluntary_sd_nm == 0.0 and subject.tremor_amplitude_nm == 0.0:
        return torque_nm
    source = SubjectTorque(subject, rate_hz, rng.spawn(1)[0])
    for start in range(1, ticks, BLOCK_TICKS):
        block = source.block(BLOCK_TICKS)
        torque_nm[start : start + BLOCK_TICKS] = block[: ticks - start]
    return torque_nm
