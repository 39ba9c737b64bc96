"""Simulated epochs as a session folder, written by the recorder of the package."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.session import SessionWriter, sample_dtypes
from rigidimeter.core.settings import Settings

REST_S = 2.0
"""Between two epochs; nothing is written of it."""


def write_session(
    folder: Path, epochs: Sequence[Epoch], settings: Settings, latency_s: float = 0.001
) -> None:
    """Write epochs as the loop would have, each tick with the newest sample that had arrived.

    Parameters
    ----------
    folder : Path
        Made if it does not exist.
    epochs : sequence of Epoch
        Whose sensors lost no sample.
    settings : Settings
    latency_s : float
        Of both sensors.
    """
    protocol = [{"number": k, "label": epoch.label} for k, epoch in enumerate(epochs)]
    writer = SessionWriter(folder, settings, protocol, {}, virtual=True, repeatable=True)
    writer.event("session_started", time_s=0.0)
    begins_s, first_tick = REST_S, 0
    for number, epoch in enumerate(epochs):
        columns = _columns(epoch, latency_s)
        columns["lateness_s"] = _lateness_s(columns["time_s"], 1.0 / settings.rig.tick_rate_hz)
        ticks = columns["time_s"].size
        for name in ("time_s", "torque_time_s", "motion_time_s"):
            columns[name] = columns[name] + begins_s
        columns["tick"] = first_tick + np.arange(ticks)
        columns["epoch"] = np.full(ticks, number)
        started_s, ended_s = float(columns["time_s"][0]), float(columns["time_s"][-1])
        writer.event(
            "epoch_started", epoch=number, label=epoch.label, task="prbs",
            condition=epoch.condition, time_s=started_s,
        )  # fmt: skip
        writer.columns(columns)
        writer.event("epoch_ended", epoch=number, time_s=ended_s, outcome="success", reason="")
        begins_s, first_tick = ended_s + REST_S, first_tick + ticks
    writer.close(begins_s, "success", "")


def _columns(epoch: Epoch, latency_s: float) -> dict[str, NDArray[Any]]:
    """Return the columns of an epoch on its own clock."""
    command = epoch.channels["velocity_command_rad_s"]
    torque, torque_at = _newest(epoch.channels["torque_nm"], command.time_s - latency_s)
    angle, motion_at = _newest(epoch.channels["angle_rad"], command.time_s - latency_s)
    velocity, _ = _newest(epoch.channels["velocity_rad_s"], command.time_s - latency_s)
    known = np.isfinite(torque_at) & np.isfinite(motion_at)
    columns = {name: np.zeros(command.time_s.size, kind) for name, kind in sample_dtypes().items()}
    columns |= {
        "time_s": command.time_s,
        "perturbation_nm": epoch.channels["perturbation_nm"].values,
        "torque_nm": torque,
        "torque_time_s": torque_at,
        "angle_rad": angle,
        "velocity_rad_s": velocity,
        "motion_time_s": motion_at,
        "target_angle_rad": np.full(command.time_s.size, np.nan),
        "velocity_request_rad_s": command.values,
        "velocity_command_rad_s": command.values,
    }
    return {name: values[known] for name, values in columns.items()}


def _lateness_s(ran_s: NDArray[np.float64], tick_s: float) -> NDArray[np.float64]:
    """Return how late each tick ran; those that were due meanwhile were missed."""
    late_s, due_s = np.zeros(ran_s.size), ran_s[0]
    for k, at_s in enumerate(ran_s):
        late_s[k] = max(at_s - due_s, 0.0)
        due_s += (np.floor(late_s[k] / tick_s + 1e-6) + 1) * tick_s
    return late_s


def _newest(channel: Channel, until_s: NDArray[np.float64]) -> tuple[Any, Any]:
    """Return value and stamp of the newest sample at each time; NaN before the first."""
    k = np.searchsorted(channel.time_s, until_s + 1e-9, side="right") - 1
    there = k >= 0
    return np.where(there, channel.values[k], np.nan), np.where(there, channel.time_s[k], np.nan)
