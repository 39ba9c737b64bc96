"""From recorded files to fits, to comparisons, to what a study concludes.

Acquisition and study meet only in recorded files, so a laboratory can analyse with no driver
installed.
"""

from rigidimeter.analysis.study.analysis import estimate
from rigidimeter.analysis.study.archive import UNCHANGED, keep
from rigidimeter.analysis.study.compare_input import compare
from rigidimeter.analysis.study.compared import TEST, Comparison, DayMedian, comparison_rows
from rigidimeter.analysis.study.comparison import (
    compare_analysis,
    compare_measures,
    recording_result,
    split_pooled,
)
from rigidimeter.analysis.study.conclusions import (
    Conclusion,
    Conclusions,
    conclude,
    conclusion_rows,
)
from rigidimeter.analysis.study.day_scatter import DayScatter, day_scatter
from rigidimeter.analysis.study.deviations import deviation_words
from rigidimeter.analysis.study.difference_rows import (
    DifferenceRow,
    difference_cells,
    difference_rows,
)
from rigidimeter.analysis.study.differences import Difference
from rigidimeter.analysis.study.families import Primary
from rigidimeter.analysis.study.fitted_terms import FittedTerms, fit_terms
from rigidimeter.analysis.study.measures import RATING, Measure, Observation, conditions
from rigidimeter.analysis.study.provenance import provenance
from rigidimeter.analysis.study.rating_relation import Relation, agreement, relations
from rigidimeter.analysis.study.ratings_found import RatingMean, RatingsFound
from rigidimeter.analysis.study.reached_precision import (
    WANTED_PERCENT,
    Precision,
    condition_precisions,
    precisions,
    precisions_untested,
)
from rigidimeter.analysis.study.results import (
    Condition,
    Exclusion,
    LeftOut,
    SensitivityRow,
    SessionEntry,
    StudyResult,
)
from rigidimeter.analysis.study.sensitivity import method_caveats
from rigidimeter.analysis.study.statements import Statements, lead, statements
from rigidimeter.analysis.study.study_analysis import analyse_study, estimate_study, read_study
from rigidimeter.analysis.study.tables import (
    columns_of_rows,
    comparison_document,
    result_table,
    result_tables,
    table_csv,
)
from rigidimeter.analysis.study.traffic_light import TrafficLight, traffic_light
