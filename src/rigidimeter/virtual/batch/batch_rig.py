"""What every epoch of a batch has in common: coefficients, ticks, and sensors without jitter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.control import admittance, butterworth_lowpass
from rigidimeter.dynamics import SAME_TIME_S, Drive, drive, sample_time_blocks_s
from rigidimeter.guard import guard_limits
from rigidimeter.records import readonly
from rigidimeter.settings import MotionSensorSettings, Settings, TorqueSensorSettings
from rigidimeter.units import rad_from_deg
from rigidimeter.virtual.batch.batch_epoch import BEFORE, NOW, Coefficients, Sampling
from rigidimeter.virtual.batch.compiled_steps import compiled

__all__ = ["Bench", "bench", "draw_sampling"]


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
    taken_s = np.concatenate(list(_through(until_s[-1], blocks)))
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
    taken = np.searchsorted(in_order_s, until_s, side="right")
    assert newest[0] >= 0  # each sensor has a sample before the first tick
    seen_s = (arrives_s - sensor.stamp_latency_s)[newest]
    return Sampling(
        _whole(taken, np.uint32),
        _whole(newest, np.uint32),
        readonly(seen_s),
        readonly(np.arange(ticks) / rig.tick_rate_hz - seen_s),
        _whole(part, np.int32),
        readonly(left),
        readonly(parts),
    )


def _through(end_s: float, blocks: Iterator[NDArray[np.float64]]) -> Iterator[NDArray[np.float64]]:
    """Yield blocks of times up to the one that passes the end."""
    for times_s in blocks:
        yield times_s
        if times_s[-1] > end_s:
            return


def _whole(values: NDArray[Any], kind: type[np.integer[Any]]) -> NDArray[Any]:
    array = values.astype(kind)
    array.setflags(write=False)
    return array
