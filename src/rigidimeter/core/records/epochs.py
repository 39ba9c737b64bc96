"""What was recorded: channels, epochs, how they ended, and what to say about an input."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidimeter.core.units import named_unit

Task = Literal["prbs", "sinusoid"]
Axis = Literal["unknown", "vertical", "horizontal"]
"""How the joint's axis stands: about a vertical one the limb's weight has no moment."""

OutcomeKind = Literal["included", "excluded", "failed"]

EMG_CHANNELS = ("emg_v", *(f"emg_{muscle}_v" for muscle in range(2, 9)))
"""Raw EMG: one muscle each."""

_MEASURED = ("torque_nm", "angle_rad", "velocity_rad_s")
_COMMANDED = ("velocity_command_rad_s", "perturbation_nm")
CHANNEL_UNITS: Mapping[str, str] = {
    name: named_unit(name)[1] for name in (*_MEASURED, *_COMMANDED, *EMG_CHANNELS)
}
"""The channels an epoch may hold, and their units."""


def readonly(values: ArrayLike) -> NDArray[np.float64]:
    """Return a read-only float64 array without gaps in memory, a copy only where it must be.

    Sums over an array round by how it lies in memory; the same values are to give the same numbers
    whatever table they were a column of.
    """
    array = np.asarray(values, dtype=np.float64, order="C").view()
    array.setflags(write=False)
    return array


@dataclass(frozen=True)
class Channel:
    """One measured quantity with its own time stamps.

    Parameters
    ----------
    name : str
        One of `CHANNEL_UNITS`; the unit is part of the name.
    time_s : array, shape (n,)
        When each sample was taken, strictly increasing. Channels of one epoch share the clock but
        neither rate nor phase: stamps may jitter.
    values : array, shape (n,)
        In the unit that the name states.
    spoken : str
        How sentences name it, such as ``emg_v (column biceps)``; empty where by its name alone.
    """

    name: str
    time_s: NDArray[np.float64]
    values: NDArray[np.float64]
    spoken: str = ""

    def __post_init__(self) -> None:
        if self.name not in CHANNEL_UNITS:
            raise ValueError(f"unknown channel {self.name!r}; known are {', '.join(CHANNEL_UNITS)}")
        time_s, values = readonly(self.time_s), readonly(self.values)
        if time_s.ndim != 1 or time_s.shape != values.shape:
            raise ValueError(
                f"channel {self.name}: {time_s.shape} stamps and {values.shape} values"
            )
        object.__setattr__(self, "time_s", time_s)
        object.__setattr__(self, "values", values)

    def __len__(self) -> int:
        return int(self.values.size)

    @property
    def unit(self) -> str:
        """The unit of the values."""
        return CHANNEL_UNITS[self.name]

    @cached_property
    def rate_hz(self) -> float:
        """The typical sampling rate: one over the median interval; NaN below two samples."""
        if len(self) < 2:
            return math.nan
        return 1.0 / float(np.median(np.diff(self.time_s)))

    @cached_property
    def mean_rate_hz(self) -> float:
        """Samples over time: for an even clock, free of the rounding of single stamps."""
        if len(self) < 2:
            return math.nan
        return (len(self) - 1) / float(self.time_s[-1] - self.time_s[0])


@dataclass(frozen=True)
class Motion:
    """What an imposed sinusoid was meant to be: needed to cut its cycles.

    `start_s` is when the motion starts, on the clock of the epoch's channels.
    """

    frequency_hz: float
    start_s: float
    duration_s: float


@dataclass(frozen=True)
class Outcome:
    """How something went: a bad epoch is a value, not an exception.

    `included` counts in every summary; `excluded` does not count, for the reason given, though it
    may have numbers; `failed` could not be computed, for the reason given, and is worth a look.
    """

    kind: OutcomeKind = "included"
    reason: str = ""

    @property
    def included(self) -> bool:
        """Whether the result counts in summaries."""
        return self.kind == "included"


@dataclass(frozen=True)
class Notice:
    """A sentence for the user about an input that was read all the same.

    A `warning` leaves the exit status alone; an `error` makes it non-zero although whatever could
    be analysed was.
    """

    level: Literal["warning", "error"]
    text: str


LOST_SAMPLES = "lost_samples"
"""The check that speaks of stretches whose samples are lost."""


class LeftOut(NamedTuple):
    """A stretch of an epoch that is not used, ends included.

    Attributes
    ----------
    start_s, stop_s : float
        On the clock of the epoch's channels.
    reason : str
        What was seen there, or what the user said of it; may be empty.
    check : str
        The check that speaks of it; empty where the user named it.
    """

    start_s: float
    stop_s: float
    reason: str = ""
    check: str = ""

    @property
    def lost(self) -> bool:
        """Whether nothing is known of it, not even what was commanded: its samples are lost."""
        return self.check == LOST_SAMPLES


LATE_TICK = 0.5
"""A tick that begins by more than so much of its length after it was due is late."""


class Ticks(NamedTuple):
    """How punctual the loop was in an epoch.

    Attributes
    ----------
    ran : int
    late : int
        Of those that ran, how many were late.
    missed : int
        That never ran, because the loop was still late when they were due. Nothing was sent at
        them: the drive held its command.
    limited : int
        Of those that ran, at how many the guard changed the command.
    """

    ran: int
    late: int
    missed: int
    limited: int = 0

    @property
    def missed_percent(self) -> float:
        """The share of the ticks due that never ran."""
        return 100.0 * self.missed / (self.ran + self.missed)


@dataclass(frozen=True)
class Epoch:
    """A stretch of recording in which one perturbation ran.

    Parameters
    ----------
    source : str
        The file or folder it came from.
    label : str
        The epoch's name within the source.
    channels : mapping of str to Channel
        By channel name. Torque is positive when it drives the joint in the direction of
        positive angle, the sign of Eq. 3.
    condition : str
        For example ``OFF`` or ``DBS``; empty where unknown.
    task : {"prbs", "sinusoid"} or None
        None where the recording does not say.
    motion : Motion or None
        The imposed sinusoid, where the recording says so.
    excitation_hz : (float, float) or None
        The band the perturbation was designed for, where the recording says so.
    closed : Outcome
        How the epoch ended when it was recorded: `included` for success.
    virtual : bool
        Whether a simulation made it.
    left_out : tuple of LeftOut
        What of it is not used.
    clock_error_s : float
        Standard error of the offset between the clocks of torque and motion, where it was found.
    ticks : Ticks or None
        Those of the loop that sent the command; None where the recording does not say.
    since_change_min : float or None
        From the change of the stimulation to the beginning; None where it is not known.
    """

    source: str
    label: str
    channels: Mapping[str, Channel]
    condition: str = ""
    task: Task | None = None
    motion: Motion | None = None
    excitation_hz: tuple[float, float] | None = None
    closed: Outcome = field(default_factory=Outcome)
    virtual: bool = False
    left_out: tuple[LeftOut, ...] = ()
    clock_error_s: float = 0.0
    ticks: Ticks | None = None
    since_change_min: float | None = None

    @property
    def name(self) -> str:
        """Source and label, as sentences name the epoch."""
        return f"{self.source}, epoch {self.label}"
