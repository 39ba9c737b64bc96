"""A study compared and concluded: what the functions of the public interface give."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rigidimeter.analysis.statistics import Effects, Summary
from rigidimeter.analysis.study_anew.compared import Compared
from rigidimeter.analysis.study_anew.comparisons import (
    EffectPair,
    OfMethod,
    Progress,
    compare_values,
    day_tests,
    effects,
    sensitivity,
)
from rigidimeter.analysis.study_anew.document import condition_names, summary_of
from rigidimeter.analysis.study_anew.rows import recorded
from rigidimeter.analysis.study_anew.sentences import Statement, statement
from rigidimeter.analysis.study_anew.study import Study
from rigidimeter.analysis.study_anew.verdicts import conclude, reasons
from rigidimeter.core.records import FindingGroup, Notice

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
        every = recorded(self.study.rows, measure)
        names = dict.fromkeys([*filter(None, self.study.pair), *every["condition"]])
        return {name: summary_of(every, name)[0] for name in names}

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
