"""All that is random of one epoch, drawn before it runs, from the streams the rig draws from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.dynamics import BLOCK_TICKS, SubjectTorque, draw_joint, rig_streams
from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.records import readonly
from rigidimeter.settings import SubjectSettings
from rigidimeter.virtual.batch.batch_epoch import Sampling
from rigidimeter.virtual.batch.batch_rig import Bench, draw_sampling

__all__ = ["EpochInputs", "draw_inputs"]


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
