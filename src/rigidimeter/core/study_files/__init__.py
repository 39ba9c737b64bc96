"""The files of a study: `study.toml`, and its tables of sessions, ratings and exclusions."""

from rigidimeter.core.study_files.continued_session import ContinuedSession, continued_session
from rigidimeter.core.study_files.day_plan import (
    PLAN_BOUNDS,
    PLAN_FILE,
    PLAN_SCHEMA,
    PLAN_TABLE,
    PlannedBlock,
    PlanToml,
    StudyPlan,
    read_plan,
    write_plan,
)
from rigidimeter.core.study_files.declaration import (
    declare_primary,
    declared_primary,
    primary_named,
    primary_words,
)
from rigidimeter.core.study_files.exclusions import (
    exclude_epoch,
    excluded_epochs,
    include_epoch,
    row_path,
)
from rigidimeter.core.study_files.extended_folder import (
    extend_study,
    rate_session,
    raters_of,
    write_new_study,
)
from rigidimeter.core.study_files.folder import StudyFolder, TableRow, is_study, read_study_folder
from rigidimeter.core.study_files.next_session import (
    PLAN_COLUMNS,
    BegunSession,
    begun_session,
    due_words,
    next_block,
    next_words,
    plan_of,
    plan_rows,
    plan_words,
    subject_of,
    wait_words,
)
from rigidimeter.core.study_files.plan_progress import (
    DueBlock,
    RecordedBlock,
    due_block,
    named_block,
    recorded_blocks,
)
from rigidimeter.core.study_files.recorded_sessions import recorded_session, session_rows
from rigidimeter.core.study_files.session_scan import (
    SESSIONS,
    ScannedSession,
    scan_session,
    session_folders,
)
from rigidimeter.core.study_files.stimulation_log import (
    STIMULATION_TABLE,
    StimulationChange,
    add_change,
    last_change,
    parse_change,
    read_changes,
)
from rigidimeter.core.study_files.study_toml import (
    STUDY_FILE,
    STUDY_SCHEMA,
    ConditionTable,
    PrimaryTable,
    StudyToml,
    SubjectTable,
    is_outside,
    is_own,
    read_study_toml,
)
from rigidimeter.core.study_files.tables import table_path, write_study_dictionary
