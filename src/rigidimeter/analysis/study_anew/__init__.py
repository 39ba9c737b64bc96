"""A study as one long table: a row for each epoch and measure, everything else a function of it.

It takes the place of `analysis.study` when it is complete.
"""

from rigidimeter.analysis.study_anew.any_table import Columns, table_study
from rigidimeter.analysis.study_anew.caveats import groups_of
from rigidimeter.analysis.study_anew.compare_input import (
    analysis_study,
    compare,
    conditions,
    estimates_study,
)
from rigidimeter.analysis.study_anew.compared import Compared
from rigidimeter.analysis.study_anew.comparisons import (
    OfMethod,
    compare_values,
    day_tests,
    method_caveats,
    precisions,
    sensitivity,
    without_deviating,
)
from rigidimeter.analysis.study_anew.day_scatter import day_scatter
from rigidimeter.analysis.study_anew.difference_rows import (
    DifferenceRow,
    difference_cells,
    difference_rows,
    p_name,
)
from rigidimeter.analysis.study_anew.document import (
    TABLES,
    Rows,
    columns_of_rows,
    comparison_document,
    conclusion_rows,
    result_table,
    table_csv,
)
from rigidimeter.analysis.study_anew.from_folder import (
    Loaded,
    analyse,
    estimate_study,
    load_study,
    prepare_study,
)
from rigidimeter.analysis.study_anew.load import load as load_recordings
from rigidimeter.analysis.study_anew.load import place_of, source_of, without_excluded
from rigidimeter.analysis.study_anew.measures import (
    LEVEL,
    MEASURES,
    RATING,
    SCORE,
    Measure,
    Primary,
)
from rigidimeter.analysis.study_anew.rating_document import (
    Relation,
    agreement,
    rating_contrast,
    rating_offsets,
    ratings_document,
    relations,
)
from rigidimeter.analysis.study_anew.rating_table import table_ratings
from rigidimeter.analysis.study_anew.ratings import (
    corrected,
    fit_scores,
    ratings_of,
)
from rigidimeter.analysis.study_anew.results import TESTS_SHARE, StudyResult, conclude_study
from rigidimeter.analysis.study_anew.rows import (
    FIELDS,
    as_rows,
    blocks,
    counting,
    estimate_rows,
    measures_of,
    pooled,
    read_rows,
    recorded,
    together,
    write_rows,
)
from rigidimeter.analysis.study_anew.sentences import (
    Statement,
    deviation_sentence,
    lead,
    statement,
    statements,
)
from rigidimeter.analysis.study_anew.session_checks import Session
from rigidimeter.analysis.study_anew.store import UNCHANGED, keep, kept_study
from rigidimeter.analysis.study_anew.study import (
    Condition,
    Deviation,
    Exclusion,
    LeftOut,
    Naming,
    Ratings,
    SessionEntry,
    Study,
    naming,
)
from rigidimeter.analysis.study_anew.tests import by_units, by_values
from rigidimeter.analysis.study_anew.verdicts import conclude, reasons, traffic_light
