"""From drawn inputs to recorded columns of many epochs, and each as an epoch for the estimation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidimeter.core.records import Channel, Epoch, Outcome, readonly
from rigidimeter.core.settings import Settings
from rigidimeter.model import BiquadState, DriveState, JointDynamics
from rigidimeter.rig.guard import Cause, guard_limits, guard_state, why_ended
from rigidimeter.virtual.batch.batch_epoch import EpochColumns, Joint
from rigidimeter.virtual.batch.batch_rig import Bench, EpochInputs
from rigidimeter.virtual.batch.compiled_steps import compiled


@dataclass(frozen=True)
class Batch:
    """PRBS epochs that each started from rest on a rig of its own.

    The columns have shape (epochs, ticks), the names and the values of a recorded session. An epoch
    that the guard ended has `ticks` entries; what comes after is NaN, and 0 in `limited`.

    Parameters
    ----------
    settings : Settings
    source : str
        Where the epochs say they come from.
    first : int
        Number of the first epoch, counted from 0.
    joints : tuple of JointDynamics
        The truth, one an epoch.
    conditions : tuple of str
    time_s : array, shape (ticks,)
        When each tick was due.
    perturbation_nm : array, shape (epochs, ticks)
    torque_nm, torque_time_s, angle_rad, velocity_rad_s, motion_time_s : array
        The newest samples at each tick, with their stamps.
    velocity_request_rad_s, velocity_command_rad_s : array
        What the controller asked for and what the guard let pass.
    limited : array of int8
        `rig.guard.Limited` values.
    ticks, cause, limited_ticks : array of int, shape (epochs,)
        Entries of the epoch, `rig.guard.Cause` value, commands that the guard changed.
    limit_time_s : array, shape (epochs,)
        When the position limit first held the command back; NaN if it never did.
    """

    settings: Settings
    source: str
    first: int
    joints: tuple[JointDynamics, ...]
    conditions: tuple[str, ...]
    time_s: NDArray[np.float64]
    perturbation_nm: NDArray[np.float64]
    torque_nm: NDArray[np.float64]
    torque_time_s: NDArray[np.float64]
    angle_rad: NDArray[np.float64]
    velocity_rad_s: NDArray[np.float64]
    motion_time_s: NDArray[np.float64]
    velocity_request_rad_s: NDArray[np.float64]
    velocity_command_rad_s: NDArray[np.float64]
    limited: NDArray[np.int8]
    ticks: NDArray[np.int64]
    cause: NDArray[np.int64]
    limit_time_s: NDArray[np.float64]
    limited_ticks: NDArray[np.int64]

    def __post_init__(self) -> None:
        for name, values in vars(self).items():
            if isinstance(values, np.ndarray):
                values = values.view()
                values.setflags(write=False)
                object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.joints)

    def epoch(self, i: int) -> Epoch:
        """Return epoch `i` of this batch as reading it from a session would give it."""
        if not 0 <= i < len(self):
            raise IndexError(f"epoch {i} of a batch of {len(self)}")
        rows = slice(0, int(self.ticks[i]))
        time_s = self.time_s[rows]
        channels = [
            _fresh("torque_nm", self.torque_time_s[i, rows], self.torque_nm[i, rows]),
            _fresh("angle_rad", self.motion_time_s[i, rows], self.angle_rad[i, rows]),
            _fresh("velocity_rad_s", self.motion_time_s[i, rows], self.velocity_rad_s[i, rows]),
            Channel("velocity_command_rad_s", time_s, self.velocity_command_rad_s[i, rows]),
            Channel("perturbation_nm", time_s, self.perturbation_nm[i, rows]),
        ]
        why = why_ended(
            guard_limits(self.settings), Cause(int(self.cause[i])), float(self.limit_time_s[i])
        )
        prbs = self.settings.prbs
        return Epoch(
            source=self.source,
            label=str(self.first + i),
            channels={channel.name: channel for channel in channels},
            condition=self.conditions[i],
            task="prbs",
            excitation_hz=(prbs.wanted_low_hz, prbs.wanted_high_hz),
            closed=Outcome("excluded", why) if why else Outcome(),
            virtual=True,
        )


def _fresh(name: str, stamps_s: NDArray[np.float64], values: NDArray[np.float64]) -> Channel:
    """Return a channel with one entry for each sample: a held reading repeats its stamp."""
    fresh = np.concatenate(([True], np.diff(stamps_s) > 0))
    return Channel(name, stamps_s[fresh], values[fresh])


_Rows = Mapping[str, NDArray[Any]]

_STAMPS = {"torque_time_s": "torque", "motion_time_s": "motion"}  # and the sensor of each
_ONE_EACH = {"ticks": np.int64, "cause": np.int64, "limited_ticks": np.int64}


def simulate_inputs(
    bench: Bench,
    perturbation_nm: ArrayLike,
    inputs: Sequence[EpochInputs],
    *,
    conditions: Sequence[str] = (),
) -> Batch:
    """Run epochs from inputs that were drawn beforehand.

    Parameters
    ----------
    bench : Bench
    perturbation_nm : array, shape (ticks,) or (epochs, ticks)
    inputs : sequence of EpochInputs
        As `draw_inputs` gives them, or changed.
    conditions : sequence of str
        One an epoch; unknown if not given.
    """
    perturbation = perturbation_rows(perturbation_nm, len(inputs))
    rows = empty_rows(len(inputs), bench)
    for row, drawn in enumerate(inputs):
        run_row(rows, row, bench, perturbation[row], drawn)
    return batch_of(
        rows,
        bench,
        perturbation,
        [drawn.joint for drawn in inputs],
        tuple(conditions) or ("",) * len(inputs),
        source="batch of given inputs",
    )


def perturbation_rows(perturbation_nm: ArrayLike, n_epochs: int) -> NDArray[np.float64]:
    """Return the perturbation as one read-only row an epoch, without copying a shared one.

    Raises
    ------
    ValueError
        If its shape is neither (ticks,) nor (n_epochs, ticks).
    """
    given = np.asarray(perturbation_nm, dtype=np.float64, order="C")
    ticks = given.shape[-1] if given.ndim else 0
    if given.shape not in ((ticks,), (n_epochs, ticks)) or ticks == 0:
        raise ValueError(
            f"the perturbation of {n_epochs} epochs must have shape (ticks,) or "
            f"({n_epochs}, ticks), got {given.shape}"
        )
    return np.broadcast_to(readonly(given), (n_epochs, ticks))


def empty_rows(n_epochs: int, bench: Bench) -> _Rows:
    """Return columns to be written, one row an epoch.

    The stamps of a sensor that keeps time are the same in every epoch: they have no rows.
    """
    columns = {
        name: np.empty((n_epochs, bench.ticks), np.int8 if name == "limited" else np.float64)
        for name in (*EpochColumns._fields, *_jittering(bench))
    }
    counts = {name: np.empty(n_epochs, dtype) for name, dtype in _ONE_EACH.items()}
    return {**columns, **counts, "limit_time_s": np.empty(n_epochs)}


def run_row(
    rows: _Rows, row: int, bench: Bench, perturbation_nm: NDArray[np.float64], inputs: EpochInputs
) -> None:
    """Run one epoch from rest into a row; rows may be run at the same time."""
    lengths = {perturbation_nm.size, inputs.torque.taken.size, inputs.motion.taken.size}
    if lengths != {bench.ticks}:  # compiled code does not look where an array ends
        raise ValueError(
            f"the bench is for {bench.ticks} ticks, but perturbation and inputs have "
            f"{', '.join(map(str, sorted(lengths)))}"
        )
    joint = inputs.joint
    ticks, *result = compiled().run_epoch(
        bench.coefficients,
        Joint(joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad),
        perturbation_nm,
        inputs.voluntary_nm,
        inputs.noise_nm,
        inputs.torque,
        inputs.motion,
        BiquadState(),
        guard_state(bench.coefficients.limits),
        DriveState(),
        EpochColumns(*(rows[name][row] for name in EpochColumns._fields)),
    )
    jittering = _jittering(bench)
    for name in jittering:
        rows[name][row] = getattr(inputs, _STAMPS[name]).seen_s
    for name, value in zip(("cause", "limit_time_s", "limited_ticks"), result, strict=True):
        rows[name][row] = value
    rows["ticks"][row] = ticks
    if ticks < bench.ticks:
        for name in (*EpochColumns._fields, *jittering):
            rows[name][row, ticks:] = 0 if name == "limited" else np.nan


def batch_of(
    rows: _Rows,
    bench: Bench,
    perturbation_nm: NDArray[np.float64],
    joints: Sequence[JointDynamics],
    conditions: Sequence[str],
    *,
    source: str,
    first: int = 0,
) -> Batch:
    """Return written rows as a batch."""
    columns = {**rows}
    ticks = rows["ticks"]
    ended = np.arange(bench.ticks) >= ticks[:, None] if ticks.min() < bench.ticks else None
    for name, sensor in _STAMPS.items():  # those that every epoch has in common
        sampling = getattr(bench, sensor)
        if sampling is not None:
            shared = np.broadcast_to(sampling.seen_s, (ticks.size, bench.ticks))
            # Copied only if one ended early.
            columns[name] = shared if ended is None else np.where(ended, np.nan, shared)
    return Batch(
        settings=bench.settings,
        source=source,
        first=first,
        joints=tuple(joints),
        conditions=tuple(conditions),
        time_s=bench.tick_s,
        perturbation_nm=perturbation_nm,
        **columns,
    )


def _jittering(bench: Bench) -> list[str]:
    """Return the stamps that differ from epoch to epoch."""
    return [name for name, sensor in _STAMPS.items() if getattr(bench, sensor) is None]
