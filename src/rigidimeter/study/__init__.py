"""From recorded files to fits, to comparisons, to what a whole study says.

Acquisition and study meet only in recorded files, so a laboratory can analyse with no driver
installed.
"""

from rigidimeter.study.analysis import analyse, estimate, task_of
from rigidimeter.study.archive import UNCHANGED, keep
from rigidimeter.study.comparison import MEASURES, Comparison, Measure, compare, conditions
from rigidimeter.study.results import (
    Cohort,
    Condition,
    DayMedian,
    DayTest,
    Exclusion,
    LeftOut,
    MeasureEffect,
    RatingsFound,
    SensitivityRow,
    SessionEntry,
    Study,
)
from rigidimeter.study.study_analysis import StudyRead, analyse_study, read_study, steps
from rigidimeter.study.tables import comparison_row, study_document
from rigidimeter.study.warnings import doubts

__all__ = [
    "MEASURES",
    "UNCHANGED",
    "Cohort",
    "Comparison",
    "Condition",
    "DayMedian",
    "DayTest",
    "Exclusion",
    "LeftOut",
    "Measure",
    "MeasureEffect",
    "RatingsFound",
    "SensitivityRow",
    "SessionEntry",
    "Study",
    "StudyRead",
    "analyse",
    "analyse_study",
    "compare",
    "comparison_row",
    "conditions",
    "doubts",
    "estimate",
    "keep",
    "read_study",
    "steps",
    "study_document",
    "task_of",
]
