"""The frozen types that travel between the rooms.

Units stand in every name. Arrays are float64 and read-only once inside a record.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "CHANNEL_UNITS",
    "PARAMETERS",
    "PARAMETER_VECTORS",
    "Analysis",
    "Channel",
    "Delay",
    "Epoch",
    "Finding",
    "Fit",
    "Motion",
    "Notice",
    "Outcome",
    "OutcomeKind",
    "Parameter",
    "Score",
    "Task",
    "readonly",
]

Task = Literal["prbs", "sinusoid"]
OutcomeKind = Literal["included", "excluded", "failed"]

CHANNEL_UNITS: Mapping[str, str] = {
    "torque_nm": "N·m",
    "angle_rad": "rad",
    "velocity_rad_s": "rad/s",
    "velocity_command_rad_s": "rad/s",
    "perturbation_nm": "N·m",
    "emg_v": "V",
}
"""The channels an epoch may hold, and their units."""


def readonly(values: ArrayLike) -> NDArray[np.float64]:
    """Return a read-only float64 view (or copy, where the type differs) of an array."""
    array = np.asarray(values, dtype=np.float64).view()
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
    """

    name: str
    time_s: NDArray[np.float64]
    values: NDArray[np.float64]

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


@dataclass(frozen=True)
class Finding:
    """What one check found in an epoch.

    Parameters
    ----------
    name : str
        The check, as the settings name it.
    level : {"note", "doubt", "exclude"}
        `note` says what is; `doubt` asks for a look before the numbers are used; `exclude` says
        that they mean nothing.
    value, threshold : float
        What was found and where it would change sides, in the unit that the text states.
    text : str
        Value, threshold and meaning in words.
    remedy : str
        What to do about it; empty where nothing is wrong.
    """

    name: str
    level: Literal["note", "doubt", "exclude"]
    value: float
    threshold: float
    text: str
    remedy: str


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

    @property
    def name(self) -> str:
        """Source and label, as sentences name the epoch."""
        return f"{self.source}, epoch {self.label}"


class Parameter(NamedTuple):
    """A parameter of Eq. 3: its name with the unit in it, its symbol, its unit, and in words."""

    name: str
    symbol: str
    unit: str
    title: str


PARAMETERS = (
    Parameter("inertia_kg_m2", "J", "kg·m²", "inertia"),
    Parameter("damping_nm_s_rad", "B", "N·m·s/rad", "damping"),
    Parameter("stiffness_nm_rad", "K", "N·m/rad", "stiffness"),
)
"""J, B and K in the order of every vector of a `Fit`."""

PARAMETER_VECTORS = {"value": "", "se": "_se", "low": "_low", "high": "_high", "bound": "_bound"}
"""The vectors of a `Fit`, and what their entries are called after the parameter's name."""


class _Entry:
    """One entry of a vector of a `Fit`, as an attribute."""

    def __init__(self, vector: str, index: int) -> None:
        self._vector, self._index = vector, index

    def __get__(self, fit: Fit, owner: type[Fit]) -> float:
        return float(getattr(fit, self._vector)[self._index])


def _unknown() -> NDArray[np.float64]:
    return np.full(len(PARAMETERS), math.nan)


def _unknown_square() -> NDArray[np.float64]:
    return np.full((len(PARAMETERS), len(PARAMETERS)), math.nan)


@dataclass(frozen=True, eq=False)
class Fit:
    """J, B, K of one epoch with their standard errors and how far to trust them.

    Numbers are NaN when the outcome is `failed`. With the inertia held fixed its standard error is
    0, and the statistics are those of the two-parameter fit. A fit to several epochs is called
    ``pooled``. Every entry of the vectors is also an attribute: `inertia_kg_m2`,
    `inertia_kg_m2_se`, `inertia_kg_m2_low`, `inertia_kg_m2_high`, `inertia_kg_m2_bound`, and
    likewise for `damping_nm_s_rad` and `stiffness_nm_rad`.

    Attributes
    ----------
    value, se : arrays, shape (3,)
        The parameters in the order of `PARAMETERS`, and their standard errors.
    low, high : arrays, shape (3,)
        The ends of the 95 % intervals.
    bound : array, shape (3,)
        The standard errors that no unbiased estimate from the same excitation can beat for the
        noise that was found (Cramér–Rao).
    covariance : array, shape (3, 3)
        Of the parameters; NaN where it is not known, as in estimates read from a file.
    r_squared : float
        1 − Σ(residual²)/Σ((torque − mean)²) over the fitted samples.
    vaf_percent : float
        Variance accounted for, 100·(1 − var(residual)/var(torque)).
    condition_number : float
        Of the regressors after each column is scaled to unit length, so that it does not depend
        on units.
    residual_sd_nm : float
        Standard deviation of the residual torque.
    n_samples : int
        Samples that entered the fit, after trimming.
    band_hz : (float, float)
        The band in which the fit was made; (0, Nyquist) for the unfiltered signals of `published`.
    """

    source: str
    epoch: str
    condition: str
    method: str
    outcome: Outcome
    value: NDArray[np.float64] = field(default_factory=_unknown)
    se: NDArray[np.float64] = field(default_factory=_unknown)
    low: NDArray[np.float64] = field(default_factory=_unknown)
    high: NDArray[np.float64] = field(default_factory=_unknown)
    bound: NDArray[np.float64] = field(default_factory=_unknown)
    covariance: NDArray[np.float64] = field(default_factory=_unknown_square)
    r_squared: float = math.nan
    vaf_percent: float = math.nan
    condition_number: float = math.nan
    residual_sd_nm: float = math.nan
    n_samples: int = 0
    band_hz: tuple[float, float] = (math.nan, math.nan)
    findings: tuple[Finding, ...] = ()

    inertia_kg_m2 = _Entry("value", 0)
    inertia_kg_m2_se = _Entry("se", 0)
    inertia_kg_m2_low = _Entry("low", 0)
    inertia_kg_m2_high = _Entry("high", 0)
    inertia_kg_m2_bound = _Entry("bound", 0)
    damping_nm_s_rad = _Entry("value", 1)
    damping_nm_s_rad_se = _Entry("se", 1)
    damping_nm_s_rad_low = _Entry("low", 1)
    damping_nm_s_rad_high = _Entry("high", 1)
    damping_nm_s_rad_bound = _Entry("bound", 1)
    stiffness_nm_rad = _Entry("value", 2)
    stiffness_nm_rad_se = _Entry("se", 2)
    stiffness_nm_rad_low = _Entry("low", 2)
    stiffness_nm_rad_high = _Entry("high", 2)
    stiffness_nm_rad_bound = _Entry("bound", 2)

    def __post_init__(self) -> None:
        p = len(PARAMETERS)
        for name, shape in (*((name, (p,)) for name in PARAMETER_VECTORS), ("covariance", (p, p))):
            array = readonly(getattr(self, name))
            if array.shape != shape:
                raise ValueError(f"{name} of a fit must have shape {shape}, not {array.shape}")
            object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        """Equal in every field; numbers that are NaN in both are equal."""
        if not isinstance(other, Fit):
            return NotImplemented
        return all(
            np.array_equal(mine, theirs, equal_nan=True)
            if isinstance(mine, float | np.ndarray) or name == "band_hz"
            else mine == theirs
            for (name, mine), theirs in zip(vars(self).items(), vars(other).values(), strict=True)
        )

    def __hash__(self) -> int:
        return hash((self.source, self.epoch, self.condition, self.method, self.outcome))

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the parameters, in the order of the vectors."""
        return tuple(parameter.name for parameter in PARAMETERS)


@dataclass(frozen=True)
class Delay:
    """How late the torque's stamps are against the motion's, in one source.

    `corrected` says whether the torque was moved by it before anything was fitted or scored;
    `remark` says why, or why there is no estimate.
    """

    source: str
    delay_s: float = math.nan
    delay_s_se: float = math.nan
    corrected: bool = False
    remark: str = ""


@dataclass(frozen=True)
class Score:
    """Angular impulse (Eq. 1) and work (Eq. 2) of one sinusoidal epoch, per cycle."""

    source: str
    epoch: str
    condition: str
    outcome: Outcome
    impulse_nm_s: float = math.nan
    work_j: float = math.nan
    n_cycles: int = 0
    frequency_hz: float = math.nan


@dataclass(frozen=True)
class Analysis:
    """What was computed from a set of epochs.

    `fits` and `fixed_inertia` run in parallel: one entry for each epoch that was fitted, in the
    order of reading. `inertia_kg_m2` is the median that the second stage held fixed (NaN if no
    epoch was included). `pooled` are the fits to all epochs of each condition together, and with
    several conditions to all epochs, whose condition is empty. `method_reason` says why a method
    was chosen where it was left open.
    """

    method: str
    fits: tuple[Fit, ...]
    fixed_inertia: tuple[Fit, ...]
    inertia_kg_m2: float
    scores: tuple[Score, ...]
    pooled: tuple[Fit, ...] = ()
    delays: tuple[Delay, ...] = ()
    method_reason: str = ""
