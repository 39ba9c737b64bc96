"""From recorded files to fits, to comparisons, to what a study concludes.

Acquisition and study meet only in recorded files, so a laboratory can analyse with no driver
installed.
"""

from rigidimeter.study.analysis import Preparation, estimate, task_of
from rigidimeter.study.archive import UNCHANGED, keep
from rigidimeter.study.compare_input import compare
from rigidimeter.study.compared import TEST, Comparison, DayMedian
from rigidimeter.study.comparison import (
    compare_analysis,
    compare_measures,
    recording_result,
    split_pooled,
)
from rigidimeter.study.conclusions import Conclusion, Conclusions, conclude, conclusion_rows
from rigidimeter.study.dependence import Dependence, dependences
from rigidimeter.study.differences import Difference
from rigidimeter.study.doubted_epochs import doubt_sentence
from rigidimeter.study.leading_effect import Leader, leader
from rigidimeter.study.measures import MEASURES, RATING, Measure, Observation, conditions
from rigidimeter.study.provenance import provenance
from rigidimeter.study.rating_relation import Agreement, Relation, agreement, relations
from rigidimeter.study.ratings_found import RatingMean, RatingsFound
from rigidimeter.study.reached_precision import (
    WANTED_PERCENT,
    Precision,
    precisions,
    precisions_untested,
)
from rigidimeter.study.results import (
    Condition,
    EffectPair,
    Exclusion,
    LeftOut,
    SensitivityRow,
    SessionEntry,
    StudyResult,
)
from rigidimeter.study.study_analysis import analyse_study, estimate_study, read_study
from rigidimeter.study.tables import comparison_document, result_table, result_tables, table_csv
from rigidimeter.study.traffic_light import TrafficLight, traffic_light
from rigidimeter.study.warnings import analysis_warnings

__all__ = [
    "MEASURES",
    "RATING",
    "TEST",
    "UNCHANGED",
    "WANTED_PERCENT",
    "Agreement",
    "Comparison",
    "Conclusion",
    "Conclusions",
    "Condition",
    "DayMedian",
    "Dependence",
    "Difference",
    "EffectPair",
    "Exclusion",
    "Leader",
    "LeftOut",
    "Measure",
    "Observation",
    "Precision",
    "Preparation",
    "RatingMean",
    "RatingsFound",
    "Relation",
    "SensitivityRow",
    "SessionEntry",
    "StudyResult",
    "TrafficLight",
    "agreement",
    "analyse_study",
    "analysis_warnings",
    "compare",
    "compare_analysis",
    "compare_measures",
    "comparison_document",
    "conclude",
    "conclusion_rows",
    "conditions",
    "dependences",
    "doubt_sentence",
    "estimate",
    "estimate_study",
    "keep",
    "leader",
    "precisions",
    "precisions_untested",
    "provenance",
    "read_study",
    "recording_result",
    "relations",
    "result_table",
    "result_tables",
    "split_pooled",
    "table_csv",
    "task_of",
    "traffic_light",
]
