"""Recordings and whole studies of a subject that does not exist, made on the virtual rig."""

from rigidimeter.virtual.rehearsal import rehearse
from rigidimeter.virtual.study_design import (
    DESIGNS,
    NULL,
    PAPER,
    PAPER_RATES,
    PUSHING,
    SHORT_EPOCH_S,
    StudyDesign,
    short_design,
)
from rigidimeter.virtual.study_plan import (
    DayPlan,
    day_factors,
    day_joint,
    draw_ratings,
    plan_study,
    spread_evenly,
)
from rigidimeter.virtual.virtual_session import run_virtual_session, session_length_s, simulate
from rigidimeter.virtual.virtual_study import study_length_s, write_virtual_study
