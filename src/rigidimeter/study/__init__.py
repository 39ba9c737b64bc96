"""From recorded files to fits, to comparisons, to what a whole study says.

Acquisition and study meet only in recorded files, so a laboratory can analyse with no driver
installed.
"""

from rigidimeter.study.analysis import analyse, checked, task_of
from rigidimeter.study.comparison import MEASURES, Comparison, Measure, compare, conditions
from rigidimeter.study.doubts import doubts
from rigidimeter.study.results import (
    Cohort,
    Condition,
    DayMedian,
    DayTest,
    Exclusion,
    MeasureEffect,
    RatingsFound,
    SensitivityRow,
    SessionEntry,
    Study,
)

__all__ = [
    "MEASURES",
    "Cohort",
    "Comparison",
    "Condition",
    "DayMedian",
    "DayTest",
    "Exclusion",
    "Measure",
    "MeasureEffect",
    "RatingsFound",
    "SensitivityRow",
    "SessionEntry",
    "Study",
    "analyse",
    "checked",
    "compare",
    "conditions",
    "doubts",
    "task_of",
]
