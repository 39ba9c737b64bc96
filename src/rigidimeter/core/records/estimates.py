"""What was estimated: parameters and their uncertainty, in other bands too, scores, findings."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import rigidimeter
from rigidimeter.core.findings import Finding, Three
from rigidimeter.core.records.activity import Activity
from rigidimeter.core.records.epochs import Outcome, readonly
from rigidimeter.core.units import deg_from_rad
from rigidimeter.core.words import html_table, interval_text, number, one_cell, one_line, with_error

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes


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

STATISTICS = ("r_squared", "vaf_percent", "condition_number", "residual_sd_nm")
"""How well a fit explains the torque, beside its parameters."""

AMPLITUDE = ("angle_rms_rad", "angle_range_rad")
"""How far the joint moved: stiffness of muscle falls with it."""

FIT_NUMBERS = (
    *(p.name + ending for p in PARAMETERS for ending in PARAMETER_VECTORS.values()),
    *STATISTICS,
)
"""The numbers of a fit, as files and tables name them; beside them stands its `AMPLITUDE`."""

SCORE_NUMBERS = ("impulse_nm_s", "work_j", "frequency_hz", "n_cycles")
"""The numbers of a score, as files and tables name them."""

BAND_VECTORS = {"value": "", "change": "_change", "change_se": "_change_se", "p": "_p"}
"""What is known of each parameter, and how the names of it end in files and tables."""


def degrees(angle_rad: float) -> str:
    """Return an angle in degrees with three digits, without the sign °; empty for NaN."""
    return "" if math.isnan(angle_rad) else number(deg_from_rad(angle_rad), 3)


class _Entry:
    """One entry of a vector of a `Fit`, as an attribute."""

    def __init__(self, vector: str, index: int) -> None:
        self._vector, self._index = vector, index

    def __get__(self, fit: Fit, owner: type[Fit]) -> float:
        return float(getattr(fit, self._vector)[self._index])


def _unknown(n_axes: int = 1) -> NDArray[np.float64]:
    return np.full((len(PARAMETERS),) * n_axes, math.nan)


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
    angle_rms_rad : float
        RMS of the angle about its mean, in the band of the fit. Of a pooled fit over the samples of
        all epochs, each about its own mean.
    angle_range_rad : float
        Largest less smallest measured angle, of all frequencies, in the part of the epoch that was
        fitted; NaN where the angle was not measured. Of a pooled fit that of the epoch in which it
        is largest.
    activity : Activity or None
        What the EMG of its epoch shows; None without EMG.
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
    covariance: NDArray[np.float64] = field(default_factory=lambda: _unknown(2))
    r_squared: float = math.nan
    vaf_percent: float = math.nan
    condition_number: float = math.nan
    residual_sd_nm: float = math.nan
    n_samples: int = 0
    band_hz: tuple[float, float] = (math.nan, math.nan)
    findings: tuple[Finding, ...] = ()
    angle_rms_rad: float = math.nan
    angle_range_rad: float = math.nan
    activity: Activity | None = None

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

    def __repr__(self) -> str:
        """Return J, B and K with their standard errors, and how they were found, as one line."""
        numbers = ", ".join(
            f"{p.symbol} {with_error(value, se)} {p.unit}"
            for p, value, se in zip(PARAMETERS, self.value, self.se, strict=True)
            if math.isfinite(value)
        )
        return one_line(numbers, self.words)

    @property
    def words(self) -> str:
        """Method, band, VAF, SD of the angle, epoch, outcome and findings, as one line."""
        low, high = self.band_hz
        band = f"{low:.3g}–{high:.3g} Hz" if math.isfinite(high) else ""
        vaf = f"VAF {self.vaf_percent:.1f} %" if math.isfinite(self.vaf_percent) else ""
        rms = degrees(self.angle_rms_rad)
        angle = f"angle SD {rms}°" if rms else ""
        label = "all epochs" if self.epoch == "pooled" else f"epoch {self.epoch}"
        outcome = f"{self.outcome.kind}: {self.outcome.reason}" * (not self.outcome.included)
        found = f"findings: {', '.join(self.cautions)}" if self.cautions else ""
        return one_line(
            one_line(self.method, band, vaf, angle, joint=", "),
            one_line(label, self.condition, joint=" "),
            outcome,
            found,
        )

    def _repr_html_(self) -> str:
        """Return J, B and K with their 95 % intervals as a table, and what the cautions say."""
        rows = [
            [
                f"{p.symbol}, {p.title}",
                *(one_cell(with_error(value, se)), one_cell(interval_text(low, high))),
                p.unit,
            ]
            for p, value, se, low, high in zip(
                PARAMETERS, self.value, self.se, self.low, self.high, strict=True
            )
        ]
        table = html_table(["", "estimate ± standard error", "95\xa0% interval", "unit"], rows)
        serious = [one for one in self.findings if one.level != "note"]
        said = [escape(f"{one.level}: {one.headline}") for one in serious]
        return "\n".join([table, *(f"<p>{text}</p>" for text in (escape(self.words), *said))])

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the parameters, in the order of the vectors."""
        return tuple(parameter.name for parameter in PARAMETERS)

    @property
    def cautions(self) -> tuple[str, ...]:
        """The names of the findings that are more than a note."""
        return tuple(dict.fromkeys(one.name for one in self.findings if one.level != "note"))

    def plot(self, *, axes: Sequence[Axes] | None = None) -> NDArray[Any]:
        """Draw J, B and K in pairs, with their 95 % intervals and the 95 % ellipse of each pair.

        A fit does not hold the torque: measured beside modelled torque is drawn by
        `Analysis.plot_torque`, which is given the recording.

        Parameters
        ----------
        axes : three matplotlib Axes, optional
            To draw on; without them a new figure is made.

        Returns
        -------
        array of matplotlib Axes, shape (3,)

        Raises
        ------
        ValueError
            If the fit has no numbers.
        """
        return rigidimeter.plot(self, axes=axes)

    def row(self) -> dict[str, Any]:
        """Return the names and numbers of the fit, as files and tables have them."""
        numbers = {name: getattr(self, name) for name in (*FIT_NUMBERS, *AMPLITUDE)}
        activity = {} if self.activity is None else self.activity.row()
        return _named(self) | numbers | {"n_samples": self.n_samples} | activity


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

    def row(self) -> dict[str, Any]:
        """Return the names and numbers of the score, as files and tables have them."""
        return _named(self) | {name: getattr(self, name) for name in SCORE_NUMBERS}


def _named(result: Fit | Score) -> dict[str, Any]:
    return {
        "source": result.source,
        "epoch": result.epoch,
        "condition": result.condition,
        "outcome": result.outcome.kind,
        "reason": result.outcome.reason,
    }


@dataclass(frozen=True)
class BandEstimate:
    """J, B and K of all epochs of a condition together, from one band and part of the epochs.

    Attributes
    ----------
    condition : str
    low_hz, high_hz : float
    part : str
        ``all``, or ``first half`` or ``second half`` of each epoch.
    value : (float, float, float)
        In the order of `PARAMETERS`.
    change, change_se : (float, float, float)
        From the estimate in the band of the fit, and the standard error of that difference.
    p : (float, float, float)
        Probability of as large a change by chance; 1 for the band of the fit.
    """

    condition: str
    low_hz: float
    high_hz: float
    part: str
    value: Three
    change: Three
    change_se: Three
    p: Three

    @property
    def of_fit(self) -> bool:
        """Whether this is the estimate that the others are held against."""
        return self.change_se == (0.0, 0.0, 0.0)

    def row(self) -> dict[str, Any]:
        """Return names and numbers, as files and tables have them."""
        numbers = {
            parameter.name + ending: getattr(self, vector)[i]
            for i, parameter in enumerate(PARAMETERS)
            for vector, ending in BAND_VECTORS.items()
        }
        where = {name: getattr(self, name) for name in ("condition", "low_hz", "high_hz", "part")}
        return where | numbers
