"""A recorded session as a device: the samples come as they came then, commands change nothing.

For the guard and the loop to be run over what was recorded. Each `read` is one tick, the tick of
the record; the stamps are the recorded ones, moved by `shift_s` to where the clock of the replay
stands. After the last tick the last sample comes again and again, so its stamp grows old, as a
sensor's does that has gone silent. What is written is kept in `written` and moves nothing.

The arrays come from the caller, under the names of `Reading`: `torque_nm`, `torque_time_s`,
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

__all__ = ["ReplayDrive", "ReplaySensor"]

TORQUE = ("torque_nm", "torque_time_s")
MOTION = ("angle_rad", "velocity_rad_s", "motion_time_s")
FASTEST_RAD_S = 100.0
"""What a drive would send at most; far above any that moves an arm."""

WHOLE_NUMBERS = ("torque_sequence", "torque_status", "motion_sequence", "motion_status", "cause")


class _Track:
    """Columns of one length, played row by row."""

    def __init__(
        self, columns: Mapping[str, ArrayLike], names: tuple[str, ...], shift_s: float
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
                    f"replay: column {name!r} has shape {array.shape}; "
                    f"({max(length, 1)},) would be right"
                )
        self._values: dict[str, list[Any]] = {}
        for name, array in arrays.items():
            kind = np.int64 if name in WHOLE_NUMBERS else np.float64
            moved = array + shift_s if name.endswith("time_s") else array
            self._values[name] = moved.astype(kind).tolist()
        self.length = length
        self.tick = -1

    def rate_hz(self, time: str) -> float:
        """Return the rate of the ticks, from the first stamp and the last."""
        times = self._values[time]
        span_s = times[-1] - times[0]
        return (self.length - 1) / span_s if span_s > 0.0 else 1.0

    def advance(self) -> None:
        """Go on by a tick, no farther than to the last."""
        self.tick = min(self.tick + 1, self.length - 1)

    def value(self, name: str, default: int = 0) -> Any:
        """Return a column's value at this tick."""
        values = self._values.get(name)
        return default if values is None else values[max(self.tick, 0)]


class _Player:
    """What the two devices have in common: a wire that is a record."""

    def __init__(self, track: _Track, time: str, watchdog_s: float | None) -> None:
        self._track, self._time, self._watchdog_s = track, time, watchdog_s
        self._connected = self._playing = False
        self._received = 0

    def connect(self) -> None:
        """Nothing to open."""
        self._connected = True

    def configure(self) -> DeviceFacts:
        """Go back to the first tick.

        Raises
        ------
        DeviceError
            If it was not connected: a replay keeps the order that a wire asks for.
        """
        if not self._connected:
            raise DeviceError("replay: configure before connect; call connect first")
        self._track.tick = -1
        self._playing = True
        rate_hz = self._track.rate_hz(self._time)
        return DeviceFacts("replay", "", rate_hz, self._watchdog_s, {"ticks": self._track.length})

    @property
    def finished(self) -> bool:
        """Whether the last tick has been read."""
        return self._track.tick >= self._track.length - 1

    def close(self) -> None:
        """Play no further."""
        self._connected = self._playing = False

    def _next(self) -> _Track:
        """Go on by a tick while it plays."""
        if self._playing:
            self._received += not self.finished
            self._track.advance()
        return self._track


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
        super().__init__(_Track(columns, TORQUE, shift_s), "torque_time_s", None)

    def read(self) -> TorqueSample:
        """Return the sample of the next tick."""
        track = self._next()
        return TorqueSample(
            track.value("torque_nm"),
            track.value("torque_time_s"),
            track.value("torque_sequence", max(track.tick, 0)),
            (),
            track.value("torque_status"),
            track.value("cause"),
        )

    @property
    def counts(self) -> Mapping[str, int]:
        """How many ticks were played."""
        return {"received": self._received, "lost": 0, "repeated": 0, "reordered": 0, "damaged": 0}


class ReplayDrive(_Player):
    """A `VelocityDrive` that plays a record; parameters as of `ReplaySensor`."""

    def __init__(self, columns: Mapping[str, ArrayLike], *, shift_s: float = 0.0) -> None:
        # A record stands still when nobody reads it, at once.
        super().__init__(_Track(columns, MOTION, shift_s), "motion_time_s", 0.0)
        self._enabled = False
        self.written: list[float] = []

    def enable(self) -> None:
        """Take note of commands from now on.

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
        track = self._next()
        return MotionSample(
            track.value("angle_rad"),
            track.value("velocity_rad_s"),
            track.value("motion_time_s"),
            track.value("motion_sequence", max(track.tick, 0)),
            (),
            track.value("motion_status"),
            track.value("cause"),
        )

    def write(self, velocity_rad_s: float) -> float:
        """Take note of a velocity as a drive would send it; without being enabled, of none."""
        if not self._enabled:
            return 0.0
        finite = math.isfinite(velocity_rad_s)
        sent = max(-FASTEST_RAD_S, min(FASTEST_RAD_S, velocity_rad_s)) if finite else 0.0
        self.written.append(sent)
        return sent

    @property
    def counts(self) -> Mapping[str, int]:
        """How many ticks were played."""
        return {"received": self._received, "lost": 0, "damaged": 0}

    def stop(self) -> None:
        """Take note of no more commands."""
        self._enabled = False

    def disable(self) -> None:
        """Take note of no more commands."""
        self._enabled = False

    def close(self) -> None:
        """Play no further."""
        super().close()
        self._enabled = False
