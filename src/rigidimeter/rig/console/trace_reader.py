"""The newest samples as traces to draw: least and largest value of each few ticks.

It reads the ring without holding up the writer. A reader that comes too late misses samples and
learns how many. Least and largest, so that no peak is lost however few points are drawn.

Torque is also drawn in the band of the live estimate, as measured and as its equation foresaw it.
Each sample passes the filters of the live estimate and its equation, in which J, B and K are those
of the samples before it. So what is drawn as modelled was never fitted to the point it is drawn at.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import OnlineSettings
from rigidimeter.rig.acquisition import REST
from rigidimeter.rig.acquisition.processes import ROW, Estimator, SampleReader, SampleRing

TRACES = (
    *("torque_nm", "angle_rad", "velocity_command_rad_s", "perturbation_nm"),
    "drive_torque_nm",
)
AT_ONCE = ("angle_rad", "torque_nm", "measured_nm", "modelled_nm")
"""What is drawn one over the other, so of each piece the values of one sample."""


class BandTorque:
    """Follows the samples of a session.

    Parameters
    ----------
    settings : OnlineSettings
    rate_hz : float
        Of the loop.
    """

    def __init__(self, settings: OnlineSettings, rate_hz: float) -> None:
        self._estimator = Estimator(settings, rate_hz)

    @property
    def since_s(self) -> float:
        """When the first sample of the epoch was taken, of which the values are."""
        return self._estimator.since_s

    def take(
        self, rows: NDArray[np.void], missed: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return measured and modelled torque of each row in N·m; NaN in a rest.

        Parameters
        ----------
        rows : array of ROW
            Following those of the last call.
        missed : int
            Samples between them; then filters and memory begin anew.
        """
        found = np.full((2, rows.size), np.nan)
        ticks = rows["tick"].tolist()
        place = dict(zip(ticks, range(len(ticks)), strict=True))
        for tick in self._estimator.steps(rows, missed):
            if tick in place:  # and was not left out by the loop
                found[:, place[tick]] = self._estimator.torque()
        return found[0], found[1]


@dataclass(frozen=True)
class Traces:
    """What came since the last call.

    Attributes
    ----------
    time_s : float array, shape (n,)
        The beginning of each piece of time.
    low, high : dict of str to float array, shape (n,)
        Least and largest value in it, by the name of the column; NaN where no value was finite.
    epoch : int array, shape (n,)
        The epoch of its last sample, -1 in a rest.
    missed : int
        Samples before these that could not be read in time.
    first : dict of str to float array, shape (n,)
        Of its first sample: `AT_ONCE`, NaN in a rest. The last two are torques in the band of the
        live estimate; empty without a `BandTorque`.
    """

    time_s: NDArray[np.float64]
    low: dict[str, NDArray[np.float64]]
    high: dict[str, NDArray[np.float64]]
    epoch: NDArray[np.int64]
    missed: int
    first: dict[str, NDArray[np.float64]] = field(default_factory=dict)


class TraceReader:
    """Reads what was written since the last call.

    Parameters
    ----------
    ring : SampleRing
    rate_hz : float
        Of the loop.
    points_per_s : float
        Pieces of time in a second, at most; each holds a whole number of ticks.
    back_s : float
        So much of what is already in the ring comes with the first call.
    columns : tuple of str
    band : BandTorque, optional
    """

    def __init__(
        self,
        ring: SampleRing,
        rate_hz: float,
        points_per_s: float = 250.0,
        back_s: float = 0.0,
        columns: tuple[str, ...] = TRACES,
        band: BandTorque | None = None,
    ) -> None:
        first = max(0, ring.written - round(back_s * rate_hz), ring.written - ring.capacity + 1)
        self._reader = SampleReader(ring, first)
        self._ticks = max(1, math.ceil(rate_hz / points_per_s))
        self._columns, self._band, self._gap = columns, band, 0
        self._rest: NDArray[np.void] = np.empty(0, ROW)

    def read(self) -> Traces:
        """Return the pieces of time that are complete; the last one waits for the next call."""
        rows, missed = self._reader.read()
        rows = np.concatenate((rows[:0] if missed else self._rest, rows))
        piece = rows["tick"] // self._ticks
        starts = np.flatnonzero(np.diff(piece, prepend=-1))
        # The last piece is complete with its last tick; else it may get more.
        if rows.size and (rows["tick"][-1] + 1) % self._ticks:
            rows, self._rest = rows[: starts[-1]], rows[starts[-1] :].copy()
            starts = starts[:-1]
        else:
            self._rest = rows[:0]
        traces = traces_of(rows, starts, self._columns, missed)
        if self._band is None:
            return traces
        self._gap += missed
        measured_nm, modelled_nm = self._band.take(rows, self._gap)
        self._gap = 0 if rows.size else self._gap
        in_epoch = np.where(rows["epoch"] == REST, np.nan, 1.0)
        angle_rad, torque_nm = rows["angle_rad"] * in_epoch, rows["torque_nm"] * in_epoch
        values = (angle_rad, torque_nm, measured_nm, modelled_nm)
        first = {name: column[starts] for name, column in zip(AT_ONCE, values, strict=True)}
        return replace(traces, first=first)


def traces_of(
    rows: NDArray[np.void], starts: NDArray[np.intp], columns: tuple[str, ...], missed: int = 0
) -> Traces:
    """Return least and largest values of the pieces of `rows` that begin at `starts`."""

    def each(reduce: np.ufunc, name: str) -> NDArray[np.float64]:
        values = np.where(np.isfinite(rows[name]), rows[name], np.nan)
        found: Any = reduce.reduceat(values, starts) if starts.size else values[:0]
        return np.asarray(found, dtype=np.float64)

    ends = np.append(starts[1:], rows.size) - 1 if starts.size else starts
    return Traces(
        rows["time_s"][starts],
        {name: each(np.fmin, name) for name in columns},
        {name: each(np.fmax, name) for name in columns},
        rows["epoch"][ends],
        missed,
    )
