"""What a report shows: an analysis with its comparisons, and what a study folder adds to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from rigidimeter.records import Analysis, Epoch, Notice
from rigidimeter.settings import Settings
from rigidimeter.statistics import Contrast, EffectDifference, Effects, Mixed
from rigidimeter.study.comparison import Comparison

__all__ = [
    "Cohort",
    "Condition",
    "DayMedian",
    "DayTest",
    "Exclusion",
    "LeftOut",
    "MeasureEffect",
    "RatingsFound",
    "SensitivityRow",
    "SessionEntry",
    "Study",
]


@dataclass(frozen=True)
class Condition:
    """One condition of a study: its name, and the stimulation if there is one.

    What was not written down is None or empty.
    """

    name: str
    title: str = ""
    frequency_hz: float | None = None
    amplitude: float | None = None
    amplitude_unit: str = ""
    pulse_width_us: float | None = None
    electrodes: str = ""
    wash_in_min: float | None = None


@dataclass(frozen=True)
class SessionEntry:
    """One recording of a study: whose, when, in what, and where it lies.

    `source` is the name by which its epochs go in an analysis; `code` is the blinded name of its
    condition as the table has it, `condition` what the key says, or the code without a key.
    """

    subject: str
    day: str
    condition: str
    code: str
    path: str
    source: str


@dataclass(frozen=True)
class DayMedian:
    """The included epochs of one measure on one day of one subject, in one condition."""

    measure: str
    subject: str
    day: str
    condition: str
    n: int
    median: float
    q1: float
    q3: float


_OFFSETS = {"condition in day": "condition within a day"}


@dataclass(frozen=True)
class DayTest:
    """A comparison in which days count, not epochs.

    Attributes
    ----------
    measure, title, unit : str
    reference, other : str
        The estimate is reference − other.
    estimate, low, high : float
        From the mixed model of `statistics.day_difference`, with Kenward and Roger's interval
        at `confidence`.
    p : float
        Kenward and Roger's.
    df : float
    days_reference, days_other : int
    p_days : float
        Of the exact rank-sum test of the medians of the days; nan where there are too few.
    day_share : float
        The share of the variance between epochs of one condition that is between days.
    offsets : tuple of str
        What had an offset in the model: ``subject``, ``day``, ``condition in day``.
    remark : str
        Why there is no test, else empty.
    """

    measure: str
    title: str
    unit: str
    reference: str
    other: str
    estimate: float
    low: float
    high: float
    p: float
    df: float
    days_reference: int
    days_other: int
    p_days: float
    day_share: float
    confidence: float = 0.95
    offsets: tuple[str, ...] = ()
    remark: str = ""

    @property
    def model(self) -> str:
        """Of what the model had offsets, in words."""
        named = [f"each {_OFFSETS.get(name, name)}" for name in self.offsets]
        return " and ".join([", ".join(named[:-1]), *named[-1:]][len(named) < 2 :])


@dataclass(frozen=True)
class MeasureEffect:
    """The effect size of one measure, with intervals that resample whole days."""

    measure: str
    title: str
    unit: str
    effects: Effects
    p_holm: float


@dataclass(frozen=True)
class RatingsFound:
    """What the examiners' scores say: `fit` by condition and examiner, and the contrast.

    `rows` are (condition, examiner, subject, day, score) in the order of the table; the corrected
    scores in `fit` go with them. `contrast_days` is the same contrast with an offset for every day
    too, None where the days cannot be told.
    """

    source: str
    rows: tuple[tuple[str, str, str, str, float], ...]
    fit: Mixed
    contrast: Contrast
    reference: str
    other: str
    notices: tuple[str, ...] = ()
    contrast_days: Contrast | None = None


@dataclass(frozen=True)
class SensitivityRow:
    """The conclusion on one measure by another road.

    `method` is the estimator; `inertia` says whether J was held at its median (``fixed``) or
    fitted with B and K in each epoch (``free``).
    """

    measure: str
    title: str
    unit: str
    method: str
    inertia: Literal["fixed", "free"]
    n_reference: int
    n_other: int
    shift: float
    shift_low: float
    shift_high: float
    p: float
    r: float
    p_day: float
    chosen: bool


@dataclass(frozen=True)
class Exclusion:
    """One epoch that does not count, who said so, and why.

    `by` is ``protocol`` (ended early or was repeated), ``check`` (a diagnostic), ``estimate`` (no
    fit) or ``operator`` (the study's table of exclusions; `who` is whom it names).
    """

    subject: str
    day: str
    condition: str
    source: str
    epoch: str
    task: str
    by: Literal["protocol", "check", "estimate", "operator"]
    reason: str
    who: str = ""


@dataclass(frozen=True)
class LeftOut:
    """One recording of the table that does not count at all, and why.

    `condition` is as the table has it, a code or a name.
    """

    path: str
    subject: str
    day: str
    condition: str
    reason: str


@dataclass(frozen=True)
class Cohort:
    """What a study folder adds to an analysis.

    Attributes
    ----------
    conditions : tuple of Condition
    sessions : tuple of SessionEntry
    blinded : bool
        Conditions are codes, because no key was given.
    days : tuple of DayMedian
    day_tests : tuple of DayTest
    effects : tuple of MeasureEffect
        One for each measure, the ratings among them.
    differences : mapping of (str, str) to EffectDifference
        Between the effect sizes of two measures, by their names.
    ratings : RatingsFound or None
    sensitivity : tuple of SensitivityRow
    exclusions : tuple of Exclusion
    virtual : bool
        Every session comes from the virtual rig.
    changes : tuple of str
        What is new since the last analysis was kept, in sentences.
    left_out : tuple of LeftOut
        Recordings of the table that do not count.
    several : bool
        J was held at each subject's own median, for there are several subjects.
    """

    conditions: tuple[Condition, ...]
    sessions: tuple[SessionEntry, ...]
    blinded: bool
    days: tuple[DayMedian, ...]
    day_tests: tuple[DayTest, ...]
    effects: tuple[MeasureEffect, ...]
    differences: Mapping[tuple[str, str], EffectDifference]
    ratings: RatingsFound | None
    sensitivity: tuple[SensitivityRow, ...]
    exclusions: tuple[Exclusion, ...]
    virtual: bool = False
    changes: tuple[str, ...] = field(default=())
    left_out: tuple[LeftOut, ...] = ()
    several: bool = False


@dataclass(frozen=True)
class Study:
    """Everything that a report shows; `cohort` where it comes from a study folder."""

    title: str
    settings: Settings
    epochs: tuple[Epoch, ...]
    analysis: Analysis
    comparisons: tuple[Comparison, ...]
    notices: tuple[Notice, ...]
    provenance: Mapping[str, str]
    cohort: Cohort | None = None
