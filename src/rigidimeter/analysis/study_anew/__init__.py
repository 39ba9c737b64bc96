"""A study as one long table: a row for each epoch and measure, everything else a function of it.

Not used by the program yet: it takes the place of `analysis.study` when it is complete.
"""

from rigidimeter.analysis.study_anew.any_table import Columns, table_study
from rigidimeter.analysis.study_anew.caveats import groups_of
from rigidimeter.analysis.study_anew.compared import Compared
from rigidimeter.analysis.study_anew.comparisons import (
    OfMethod,
    compare,
    compare_values,
    sensitivity,
    without_deviating,
)
from rigidimeter.analysis.study_anew.document import (
    Result,
    comparison_document,
    conclude_study,
    conclusion_rows,
    result_table,
)
from rigidimeter.analysis.study_anew.from_folder import Loaded, analyse, load_study
from rigidimeter.analysis.study_anew.measures import MEASURES, RATING, SCORE, Measure, Primary
from rigidimeter.analysis.study_anew.rating_document import agreement
from rigidimeter.analysis.study_anew.ratings import corrected, ratings_of
from rigidimeter.analysis.study_anew.rows import (
    FIELDS,
    as_rows,
    blocks,
    counting,
    estimate_rows,
    read_rows,
    together,
    write_rows,
)
from rigidimeter.analysis.study_anew.sentences import (
    deviation_sentence,
    lead,
    statement,
    statements,
)
from rigidimeter.analysis.study_anew.study import (
    Condition,
    Deviation,
    Exclusion,
    LeftOut,
    Ratings,
    SessionEntry,
    Study,
)
from rigidimeter.analysis.study_anew.tests import by_units, by_values
from rigidimeter.analysis.study_anew.verdicts import conclude, reasons, traffic_light
