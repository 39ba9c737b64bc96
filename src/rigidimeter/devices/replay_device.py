"""A recorded session as a device: it returns the recorded samples, and commands have no effect.

With it the loop and the guard can run on recorded data. Each `read` returns one recorded tick; the
time stamps are the recorded ones plus `shift_s`, which aligns them with the present clock. After
the last tick the last sample is repeated, so its time stamp ages as if the sensor had gone silent.
What is written is kept in `written`.

The arrays are passed by the caller, under the names of `Reading`: `torque_nm`, `torque_time_s`,
`angle_rad`, `velocity_rad_s`, `motion_time_s`, and where there are any `torque_sequence`,
`torque_status`, `motion_sequence`, `motion_status` and `cause`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rigidimeter.devices.base import DeviceError, DeviceFacts, MotionSample, TorqueSample

TORQUE = ("torque_nm", "torque_time_s")
MOTION = ("angle_rad", "velocity_rad_s", "motion_time_s")
FASTEST_RAD_S = 100.0
"""Limit of a command; far above any that moves an arm."""

WHOLE_NUMBERS = ("torque_sequence", "torque_status", "motion_sequence", "motion_status", "cause")


class _Player:
    """Columns of one length, played row by row; what sensor and drive have in common."""

    def __init__(
        self,
        columns: Mapping[str, ArrayLike],
        names: tuple[str, ...],
        shift_s: float,
        watchdog_s: float | None,
    ) -> None:
        missing = [name for name in names if name not in columns]
        if missing:
            raise DeviceError(f"replay: the record has no column {missing[0]!r}")
        wanted = [*names, *(name for name in WHOLE_NUMBERS if name in columns)]
        arrays = {name: np.asarray(columns[name]) for name in wanted}
        length = len(arrays[names[0]])
        for name, array in arrays.items():
            if array.shape != (length,) or length == 0:
                raise DeviceError(
                    f"replay: column {name!r} has shape {array.shape}; expected ({max(length, 1)},)"
                )
        self._values: dict[str, list[Any]] = {}
        for name, array in arrays.items():
            kind = np.int64 if name in WHOLE_NUMBERS else np.float64
            moved = array + shift_s if name.endswith("time_s") else array
            self._values[name] = moved.astype(kind).tolist()
        self._length = length
        self._time_s = self._values[names[-1]]
        self._watchdog_s = watchdog_s
        self._tick = -1
        self._connected = self._playing = False
        self._received = 0

    def connect(self) -> None:
        """Do nothing but note it: there is no connection."""
        self._connected = True

    def configure(self) -> DeviceFacts:
        """Go back to the first tick.

        Raises
        ------
        DeviceError
            If it was not connected: a replay requires the same order as a real device.
        """
        if not self._connected:
            raise DeviceError("replay: configure before connect; call connect first")
        self._tick = -1
        self._playing = True
        span_s = self._time_s[-1] - self._time_s[0]
        rate_hz = (self._length - 1) / span_s if span_s > 0.0 else 1.0
        return DeviceFacts("replay", "", rate_hz, self._watchdog_s, {"ticks": self._length})

    @property
    def finished(self) -> bool:
        """Whether the last tick has been read."""
        return self._tick >= self._length - 1

    def close(self) -> None:
        """Stop playing."""
        self._connected = self._playing = False

    def _advance(self) -> None:
        """Go to the next tick while playing, but not beyond the last."""
        if self._playing and not self.finished:
            self._received += 1
            self._tick += 1

    def _value(self, name: str, default: int = 0) -> Any:
        """Return the value of a column at this tick."""
        values = self._values.get(name)
        return default if values is None else values[max(self._tick, 0)]


class ReplaySensor(_Player):
    """A `TorqueSensor` that plays a record.

    Parameters
    ----------
    columns : mapping
        Arrays of one length by name.
    shift_s : float
        Added to every stamp.
    """

    def __init__(self, columns: Mapping[str, ArrayLike], *, shift_s: float = 0.0) -> None:
        super().__init__(columns, TORQUE, shift_s, None)

    def read(self) -> TorqueSample:
        """Return the sample of the next tick."""
        self._advance()
        return TorqueSample(
            self._value("torque_nm"),
            self._value("torque_time_s"),
            self._value("torque_sequence", max(self._tick, 0)),
            (),
            self._value("torque_status"),
            self._value("cause"),
        )

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of ticks played."""
        return {"received": self._received, "lost": 0, "repeated": 0, "reordered": 0, "damaged": 0}


class ReplayDrive(_Player):
    """A `VelocityDrive` that plays a record; parameters as of `ReplaySensor`."""

    def __init__(self, columns: Mapping[str, ArrayLike], *, shift_s: float = 0.0) -> None:
        # Without reads a replay stops at once: a watchdog of 0 s.
        super().__init__(columns, MOTION, shift_s, 0.0)
        self._enabled = False
        self.written: list[float] = []

    def enable(self) -> None:
        """Store commands from now on.

        Raises
        ------
        DeviceError
            If it was not configured.
        """
        if not self._playing:
            raise DeviceError("replay: enable before configure; call connect and configure first")
        self._enabled = True

    def read(self) -> MotionSample:
        """Return the sample of the next tick."""
        self._advance()
        return MotionSample(
            self._value("angle_rad"),
            self._value("velocity_rad_s"),
            self._value("motion_time_s"),
            self._value("motion_sequence", max(self._tick, 0)),
            (),
            self._value("motion_status"),
            self._value("cause"),
        )

    def write(self, velocity_rad_s: float) -> float:
        """Store a velocity as a drive would send it; return 0 if not enabled."""
        if not self._enabled:
            return 0.0
        finite = math.isfinite(velocity_rad_s)
        sent = max(-FASTEST_RAD_S, min(FASTEST_RAD_S, velocity_rad_s)) if finite else 0.0
        self.written.append(sent)
        return sent

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of ticks played."""
        return {"received": self._received, "lost": 0, "damaged": 0}

    def stop(self) -> None:
        """Store no more commands."""
        self._enabled = False

    def disable(self) -> None:
        """Store no more commands."""
        self._enabled = False

    def close(self) -> None:
        """Stop playing."""
        super().close()
        self._enabled = False
