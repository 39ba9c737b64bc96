"""From recorded files to fits, to comparisons, to what a study concludes.

Acquisition and study meet only in recorded files, so a laboratory can analyse with no driver
installed.
"""

from rigidimeter.study.analysis import Preparation, estimate, task_of
from rigidimeter.study.archive import UNCHANGED, keep
from rigidimeter.study.compare_input import compare
from rigidimeter.study.compared import TEST, Comparison, DayMedian, comparison_rows
from rigidimeter.study.comparison import (
    compare_analysis,
    compare_measures,
    recording_result,
    split_pooled,
)
from rigidimeter.study.conclusions import Conclusion, Conclusions, conclude, conclusion_rows
from rigidimeter.study.differences import Difference
from rigidimeter.study.doubted_epochs import doubt_sentence
from rigidimeter.study.measures import RATING, Measure, Observation, conditions
from rigidimeter.study.provenance import provenance
from rigidimeter.study.rating_relation import Relation, agreement, relations
from rigidimeter.study.ratings_found import RatingMean, RatingsFound
from rigidimeter.study.reached_precision import (
    WANTED_PERCENT,
    Precision,
    precisions,
    precisions_untested,
)
from rigidimeter.study.results import (
    Condition,
    Exclusion,
    LeftOut,
    SensitivityRow,
    SessionEntry,
    StudyResult,
)
from rigidimeter.study.sensitivity import method_caveats
from rigidimeter.study.study_analysis import analyse_study, estimate_study, read_study
from rigidimeter.study.tables import comparison_document, result_table, result_tables, table_csv
from rigidimeter.study.traffic_light import TrafficLight, traffic_light
from rigidimeter.study.warnings import analysis_warnings
