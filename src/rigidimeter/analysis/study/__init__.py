"""A study as one long table: a row for each epoch and measure, everything else a function of it.

It takes the place of `analysis.study` when it is complete.
"""

from rigidimeter.analysis.study.any_table import Columns, table_study
from rigidimeter.analysis.study.caveats import groups_of
from rigidimeter.analysis.study.compare_input import (
    analysis_study,
    compare,
    conditions,
    estimates_study,
)
from rigidimeter.analysis.study.compared import Compared
from rigidimeter.analysis.study.comparisons import (
    OfMethod,
    compare_values,
    day_tests,
    method_caveats,
    precisions,
    sensitivity,
    without_deviating,
)
from rigidimeter.analysis.study.differences import (
    difference_cells,
    p_name,
    shown_cells,
)
from rigidimeter.analysis.study.document import (
    TABLES,
    Rows,
    columns_of_rows,
    comparison_document,
    conclusion_rows,
    condition_names,
    result_table,
    table_csv,
)
from rigidimeter.analysis.study.from_folder import (
    Loaded,
    analyse,
    estimate_study,
    load_study,
    prepare_study,
)
from rigidimeter.analysis.study.load import load as load_recordings
from rigidimeter.analysis.study.load import place_of, source_of, without_excluded
from rigidimeter.analysis.study.measures import (
    LEVEL,
    MEASURES,
    RATING,
    SCORE,
    Measure,
    Primary,
)
from rigidimeter.analysis.study.rating_document import (
    Relation,
    agreement,
    rating_contrast,
    rating_offsets,
    ratings_document,
    relations,
)
from rigidimeter.analysis.study.rating_table import table_ratings
from rigidimeter.analysis.study.ratings import (
    corrected,
    fit_scores,
    ratings_of,
)
from rigidimeter.analysis.study.results import TESTS_SHARE, StudyResult, conclude_study
from rigidimeter.analysis.study.rows import (
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
from rigidimeter.analysis.study.scatter import day_scatter
from rigidimeter.analysis.study.sentences import (
    Statement,
    deviation_sentence,
    lead,
    statement,
    statements,
)
from rigidimeter.analysis.study.session_checks import Session
from rigidimeter.analysis.study.store import UNCHANGED, keep, kept_study
from rigidimeter.analysis.study.study import (
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
from rigidimeter.analysis.study.tests import by_units, by_values
from rigidimeter.analysis.study.verdicts import conclude, reasons, traffic_light
