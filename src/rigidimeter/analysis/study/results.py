"""What a comparison of two conditions found: every number that a page, a table or a line shows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from typing import TYPE_CHECKING, Any, Literal

import rigidimeter
from rigidimeter.analysis.estimation import Ready
from rigidimeter.analysis.statistics import EffectDifference
from rigidimeter.analysis.study.compared import Comparison, comparison_rows
from rigidimeter.analysis.study.families import Primary
from rigidimeter.analysis.study.measures import Measure
from rigidimeter.analysis.study.ratings_found import RatingsFound
from rigidimeter.core.records import Analysis, Epoch, FindingGroup, Fit, Notice, Score
from rigidimeter.core.settings import Settings
from rigidimeter.core.words import html_table, one_line, series, with_error

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from rigidimeter.analysis.study.statements import Statements

_READ = (
    *("measure", "unit", "reference", "other", "value_reference", "value_other"),
    *("difference", "difference_low", "difference_high", "p_holm", "verdict", "reason"),
)
"""The columns of a table that is read by people."""


@dataclass(frozen=True)
class EffectPair:
    """How much larger the effect size of one measure is than that of another, by stored names.

    `p_holm` is adjusted by Holm's method for all pairs.
    """

    first: str
    second: str
    difference: EffectDifference
    p_holm: float


@dataclass(frozen=True)
class Condition:
    """One condition of a study: its name, and the stimulation if there is one.

    What was not written down is None or empty. `simulated` are the medians of a virtual condition,
    by the names of the measures.
    """

    name: str
    title: str = ""
    frequency_hz: float | None = None
    amplitude: float | None = None
    amplitude_unit: str = ""
    pulse_width_us: float | None = None
    electrodes: str = ""
    wash_in_min: float | None = None
    simulated: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class SessionEntry:
    """One recording of a study: whose, when, in what condition, and where it lies.

    `group` is that of the subject, such as patients; empty where the table has none.
    `source` is the name by which its epochs go in an analysis; `code` is the blinded name of its
    condition as the table has it, `condition` what the key says, or the code without a key.
    """

    subject: str
    day: str
    condition: str
    code: str
    path: str
    source: str
    group: str = ""


@dataclass(frozen=True)
class SensitivityRow:
    """The comparison of one measure by another method.

    `method` is the estimator; `inertia` says whether J was held at its median (``fixed``) or
    fitted with B and K in each epoch (``free``). `p_day` is that of the test by days.
    """

    measure: Measure
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
    """One recording of a study's table that does not count at all, and why.

    `condition` is as the table has it, a code or a name.
    """

    path: str
    subject: str
    day: str
    condition: str
    reason: str


@dataclass(frozen=True)
class Deviation:
    """One way in which a session was not as planned.

    Attributes
    ----------
    subject, day : str
    order : int
        Place in the day that was planned; 0 where none was.
    condition : str
    path : str
        Of the session; empty where none was recorded.
    kind : str
        ``not done``, ``not planned``, ``out of order``, ``short wait``, ``unknown wait``, ``other
        protocol``, ``cut short``, ``plan edited``.
    detail : str
    """

    subject: str
    day: str
    order: int
    condition: str
    path: str
    kind: str
    detail: str


@dataclass(frozen=True)
class StudyResult:
    """Everything that was concluded from two conditions of recordings, a study or a table.

    Attributes
    ----------
    title : str
    reference, other : str
        The conditions that are compared; `other` is empty where there is only one.
    comparisons : tuple of Comparison
        One for each measure; the ratings of a study are the last.
    further : tuple of Comparison
        Those of each other condition with the reference, where no two were chosen; p is adjusted
        for these and `comparisons` together.
    differences : tuple of EffectPair
    notices : tuple of Notice
    seed, resamples : int
        Of the bootstrap.
    source, by : str
        The table and its column of conditions, where columns of a table are compared.
    analysis, epochs, settings
        What was analysed; empty for columns of a table.
    prepared : tuple of Ready
        The epochs as they were analysed, with what was made of them, for the figures; empty where
        they were not analysed here.
    provenance : mapping of str to str
    conditions, sessions, blinded, virtual, ratings, sensitivity, exclusions, left_out, changes
        Of a study folder alone; `sessions` is empty if there is none. `blinded`: the conditions are
        codes, for no key was given. `virtual`: every session comes from the virtual rig.
        `changes`: what is new since the last analysis was kept, in sentences.
    deviations : tuple of Deviation
        Of a study folder with a plan.
    own_rig : bool
        Whether a session of this program was among what was analysed, so that the settings of the
        rig are those that it was recorded with.
    primary : Primary
    """

    title: str
    reference: str
    other: str
    comparisons: tuple[Comparison, ...]
    differences: tuple[EffectPair, ...] = ()
    notices: tuple[Notice, ...] = ()
    seed: int = 1
    resamples: int = 9999
    source: str = ""
    by: str = ""
    analysis: Analysis = Analysis("", (), (), math.nan, ())  # noqa: RUF009
    epochs: tuple[Epoch, ...] = ()
    prepared: tuple[Ready, ...] = field(default=(), repr=False, compare=False)
    settings: Settings = field(default_factory=Settings)
    provenance: Mapping[str, str] = field(default_factory=dict)
    conditions: tuple[Condition, ...] = ()
    sessions: tuple[SessionEntry, ...] = ()
    blinded: bool = False
    virtual: bool = False
    ratings: RatingsFound | None = None
    sensitivity: tuple[SensitivityRow, ...] = ()
    exclusions: tuple[Exclusion, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    changes: tuple[str, ...] = ()
    own_rig: bool = False
    further: tuple[Comparison, ...] = ()
    primary: Primary = Primary()  # noqa: RUF009
    deviations: tuple[Deviation, ...] = ()

    @property
    def further_pairs(self) -> tuple[StudyResult, ...]:
        """The same result with each further condition in the place of `other`."""
        every = (*self.comparisons, *self.further)
        return tuple(
            replace(
                self,
                other=other,
                comparisons=tuple(c for c in self.further if c.other == other),
                further=tuple(c for c in every if c.other != other),
                ratings=None if self.ratings is None else replace(self.ratings, other=other),
            )
            for other in dict.fromkeys(c.other for c in self.further)
        )

    @property
    def condition_names(self) -> tuple[str, ...]:
        """All conditions in the order of the study or the protocol, then as recorded."""
        compared = [name for name in (self.reference, self.other) if name]
        found = self.analysis
        results: tuple[Fit | Score, ...] = (*found.fits, *found.fixed_inertia, *found.scores)
        recorded = [each.condition for each in (*self.epochs, *results)]
        tabled = [name for each in self.comparisons for name in each.summaries]
        order = [each.name for each in self.conditions]
        order = order or [block.condition for block in self.settings.protocol.blocks]
        found_in = dict.fromkeys([*compared, *recorded, *tabled])
        return tuple(sorted(found_in, key=lambda n: order.index(n) if n in order else len(order)))

    @property
    def several_subjects(self) -> bool:
        """Whether J was held at each subject's own median, for there are several subjects."""
        return len({session.subject for session in self.sessions}) > 1

    @property
    def resampled(self) -> str:
        """What the bootstrap of the effect sizes resamples."""
        if not self.sessions:
            return "sessions or single values"
        return "the days of each subject" if self.several_subjects else "whole days"

    def comparison(self, measure: str) -> Comparison | None:
        """Return the comparison of a measure by its stored name."""
        return next((each for each in self.comparisons if each.measure.name == measure), None)

    @property
    def statements(self) -> Statements | None:
        """What was measured, tested and concluded, in words; None of one condition alone.

        Of each comparison with the reference, those of `further` too.
        """
        from rigidimeter.analysis.study.statements import statements_of_all

        return statements_of_all(self)

    @property
    def findings(self) -> tuple[FindingGroup, ...]:
        """What the checks found in the epochs, and the reasons of the verdicts, by measures."""
        from rigidimeter.analysis.study.conclusions import reasons

        return (*self.analysis.findings, *reasons(self))

    def table(self, *, full: bool = False) -> pd.DataFrame:
        """Return the comparisons as a pandas table, a row for each measure.

        Parameters
        ----------
        full : bool
            All columns of ``rigidimeter compare --csv``, and a single condition. Otherwise the two
            values of each measure, their difference (other − reference) with the 95 % interval of
            its test, p after Holm, and what is concluded.
        """
        import pandas as pd

        from rigidimeter.analysis.study.conclusions import conclusion_rows

        if full or not self.other:
            return pd.DataFrame(comparison_rows((*self.comparisons, *self.further)))
        return pd.DataFrame(conclusion_rows(self), columns=list(_READ))

    def plot(
        self, measures: Sequence[str] | None = None, *, axes: Sequence[Axes] | None = None
    ) -> NDArray[Any]:
        """Draw every value of each measure by condition.

        A point with its 95 % interval is an epoch, the bar beside the points goes from the lower to
        the upper quartile, the diamond is the median, and the open square the estimate of all
        epochs of the condition together. Above are p and effect size of the rank-sum test, for
        which all values are independent: conclusions on a study go by its days.

        Parameters
        ----------
        measures : sequence of str, optional
            Stored names, such as ``"stiffness_nm_rad"``. Default: all but ratings.
        axes : matplotlib Axes, optional
            To draw on, one for each measure; without them a new figure is made.

        Returns
        -------
        array of matplotlib Axes, shape (number of measures,)

        Raises
        ------
        ValueError
            If a measure was not compared.
        """
        return rigidimeter.plot(self, measures=measures, axes=axes)

    def plot_days(self, measure: str = "stiffness_nm_rad", *, axes: Axes | None = None) -> Axes:
        """Draw a measure day by day: every value a point, and each day's median and quartiles.

        A line joins the medians of a day that has both conditions.

        Raises
        ------
        ValueError
            If the measure was not compared, or days are not known, as they are of a study folder.
        """
        return rigidimeter.plot(self, "days", measure=measure, axes=axes)

    def plot_effects(self, *, axes: Axes | None = None) -> Axes:
        """Draw the effect size r of each measure with its 95 % interval.

        Raises
        ------
        ValueError
            If no measure was tested.
        """
        return rigidimeter.plot(self, "effects", axes=axes)

    def __repr__(self) -> str:
        """Return the medians of the conditions in each measure as one line."""
        others = dict.fromkeys((self.other, *(c.other for c in self.further)))
        names = [name for name in (self.reference, *others) if name]
        shown = []
        for c in self.comparisons:
            found = [c.summaries[name] for name in names or c.pair if name in c.summaries]
            medians = series([with_error(s.median, math.nan) for s in found])
            shown.append(one_line(c.measure.title, medians, c.measure.unit, joint=" "))
        medians = f"medians: {', '.join(shown)}" if shown else ""
        return one_line(self.title, series(names), medians)

    def _repr_html_(self) -> str:
        """Return what the terminal shows of each measure, by pairs of conditions."""
        from rigidimeter.analysis.study.difference_rows import difference_cells

        tables = [difference_cells(pair) for pair in (self, *self.further_pairs) if pair.other]
        shown = [html_table(headings, cells) for headings, cells in tables]
        return "\n".join([f"<p>{escape(self.title)}</p>", *(shown or [escape(repr(self))])])
