"""A study compared and concluded: what the functions of the public interface give."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any

import pandas as pd

import rigidimeter
from rigidimeter.analysis.statistics import Effects, Summary
from rigidimeter.analysis.study.compared import Compared
from rigidimeter.analysis.study.comparisons import (
    EffectPair,
    OfMethod,
    Progress,
    compare_values,
    day_tests,
    effects,
    sensitivity,
)
from rigidimeter.analysis.study.differences import difference_cells
from rigidimeter.analysis.study.document import (
    comparison_rows,
    conclusion_rows,
    condition_names,
    summaries_of,
)
from rigidimeter.analysis.study.rows import measures_of
from rigidimeter.analysis.study.sentences import Statement, statement
from rigidimeter.analysis.study.study import Study
from rigidimeter.analysis.study.verdicts import conclude, reasons
from rigidimeter.core.records import FindingGroup, Notice
from rigidimeter.core.words import html_table, one_line, series, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

_READ = (
    *("measure", "unit", "reference", "other", "value_reference", "value_other"),
    *("difference", "difference_low", "difference_high", "p_holm", "verdict", "reason"),
)
"""The columns of a table that is read by people."""

TESTS_SHARE = 0.1
"""Of the work on a study folder: what its tests take."""


@dataclass(frozen=True)
class StudyResult:
    """Everything that was concluded from conditions of recordings, a study or a table.

    Attributes
    ----------
    study : Study
        What was compared: its rows, conditions, sessions, settings and estimates.
    comparisons : tuple of Compared
        What is concluded of each measure in each pair of conditions; the first pair is the main
        one. Empty where there is one condition.
    values : tuple of Compared
        The rank-sum tests, in which each epoch counts, with p by Holm's method; of one condition
        alone a row for each measure without a test.
    effects : mapping of str to Effects
        Effect sizes of the main pair, by the name of the measure.
    effect_pairs : tuple of EffectPair
    methods : tuple of OfMethod
        The main pair by every method; of a study folder alone.
    notices : tuple of Notice
    seed, resamples : int
        Of the bootstrap.
    """

    study: Study
    comparisons: tuple[Compared, ...]
    values: tuple[Compared, ...]
    effects: Mapping[str, Effects] = field(default_factory=dict)
    effect_pairs: tuple[EffectPair, ...] = ()
    methods: tuple[OfMethod, ...] = ()
    notices: tuple[Notice, ...] = ()
    seed: int = 1
    resamples: int = 9999

    def comparison(self, measure: str, other: str | None = None) -> Compared | None:
        """Return what is concluded of a measure, by its stored name.

        `other` is the condition that is compared with the reference; that of the main pair by
        default.
        """
        return self._of(self.comparisons, measure, other)

    def value_test(self, measure: str, other: str | None = None) -> Compared | None:
        """Return the rank-sum test of a measure, by its stored name."""
        return self._of(self.values, measure, other)

    def _of(self, each: tuple[Compared, ...], measure: str, other: str | None) -> Compared | None:
        wanted = measure, self.study.other if other is None else other
        return next((one for one in each if (one.measure.name, one.other) == wanted), None)

    def summaries(self, measure: str) -> dict[str, Summary]:
        """Return the summary of the values of a measure by condition; the compared ones first."""
        return {name: own for name, (own, _) in summaries_of(self.study, measure).items()}

    @property
    def condition_names(self) -> tuple[str, ...]:
        """All conditions in the order of the study or the protocol, then as recorded."""
        return condition_names(self.study)

    @property
    def several_subjects(self) -> bool:
        """Whether J was held at each subject's own median, for there are several subjects."""
        return len({session.subject for session in self.study.sessions}) > 1

    @property
    def resampled(self) -> str:
        """What the bootstrap of the effect sizes resamples."""
        if not self.study.sessions:
            return "sessions or single values"
        return "the days of each subject" if self.several_subjects else "whole days"

    @property
    def statements(self) -> Statement | None:
        """What was measured, tested and concluded, in words; None of one condition alone.

        Of each condition beside the reference.
        """
        return statement(self.study, self.comparisons)

    @property
    def findings(self) -> tuple[FindingGroup, ...]:
        """What the checks found in the epochs, and the reasons of the verdicts, by measures."""
        return (*self.study.analysis.findings, *reasons(self.comparisons))

    def table(self, *, full: bool = False) -> pd.DataFrame:
        """Return the comparisons as a pandas table, a row for each measure.

        Parameters
        ----------
        full : bool
            All columns of ``rigidimeter compare --csv``, and a single condition. Otherwise the two
            values of each measure, their difference (other − reference) with the 95 % interval of
            its test, p after Holm, and what is concluded.
        """
        if full or not self.study.other:
            return pd.DataFrame(comparison_rows(self))
        return pd.DataFrame(conclusion_rows(self.comparisons), columns=list(_READ))

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
        study = self.study
        names = [name for name in (study.reference, *study.others) if name]
        shown = []
        for measure in measures_of(study.rows):
            known = self.summaries(measure.name)
            medians = [known[name].median for name in names or [""] if name in known]
            words = series([with_error(median, math.nan) for median in medians])
            shown.append(one_line(measure.title, words, measure.unit, joint=" "))
        medians_of_each = f"medians: {', '.join(shown)}" if shown else ""
        return one_line(study.title, series(names), medians_of_each)

    def _repr_html_(self) -> str:
        """Return what the terminal shows of each measure, by pairs of conditions."""
        shown = [html_table(*difference_cells(self, other)) for other in self.study.others]
        return "\n".join([f"<p>{escape(self.study.title)}</p>", *(shown or [escape(repr(self))])])


def conclude_study(
    study: Study,
    *,
    seed: int = 1,
    resamples: int = 9999,
    progress: Progress = lambda _: None,
) -> StudyResult:
    """Compare a study and conclude from it, once.

    Parameters
    ----------
    study : Study
    seed, resamples : int
        Of the bootstrap; with 0 resamples there are no effect sizes with intervals.
    progress : callable
        Called with the share of the work that was done since, 1 in all.
    """
    values = compare_values(study)
    sizes, pairs = effects(study, values, seed=seed, resamples=resamples, progress=progress)
    methods: tuple[OfMethod, ...] = ()
    notices = study.notices
    if study.sessions and study.other:
        methods, lacking = sensitivity(study.rows, study.pair)
        notices = (*notices, *lacking)
    concluded = conclude(study, day_tests(study), methods)
    return StudyResult(study, concluded, values, sizes, pairs, methods, notices, seed, resamples)
