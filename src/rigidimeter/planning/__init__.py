"""The experiment before it runs: perturbations, session order, predicted precision, power."""

from rigidimeter.planning.assumed_scatter import (
    ASSUMED,
    CORRELATION,
    DAY_CV_PERCENT,
    EPOCH_CV_PERCENT,
    Scatter,
    day_difference_sd,
)
from rigidimeter.planning.days_needed import (
    Detection,
    Needed,
    WantedDifference,
    detections,
    planned_epochs,
)
from rigidimeter.planning.document import DESIGN_SCHEMA, design_document
from rigidimeter.planning.dose import (
    NO_DOSE,
    Dose,
    dose_objection,
    dose_part,
    dose_reached,
    dose_words,
)
from rigidimeter.planning.drawn_plan import (
    BOUNDS,
    DrawnPlan,
    PlanValues,
    day_settings,
    days_of_design,
    draw_plan,
    plan_days_of,
    plan_names,
)
from rigidimeter.planning.joint_bandwidth import (
    APPENDIX_A,
    CONTROLLER_INERTIA_KG_M2,
    ROBOT_INERTIA_KG_M2,
    Corner,
    Forearm,
    corners,
)
from rigidimeter.planning.motion_demand import (
    beyond_limits,
    beyond_range,
    demand,
    ideal_response,
    time_constant_s,
    too_few_cycles,
)
from rigidimeter.planning.multisine import (
    MultisineComparison,
    compare_multisine,
    crest_factor,
    multisine_nm,
    multisine_phases_rad,
)
from rigidimeter.planning.overview import Design, design
from rigidimeter.planning.paired_test import paired_power, pairs_needed
from rigidimeter.planning.perturbation_band import (
    HALF_POWER_DB,
    check_band,
    envelope_db,
    envelope_edge_hz,
    line_spacing_hz,
    plateau_n2m2_hz,
    power_spectrum,
)
from rigidimeter.planning.perturbations import (
    chip_count,
    draw_rests_s,
    exact_decimal,
    plan,
    prbs_levels,
    prbs_nm,
    prbs_period_s,
    rest_generator,
    sinusoid,
    tick_count,
    tick_times_s,
)
from rigidimeter.planning.plan_sentence import count_words, plan_sentence
from rigidimeter.planning.precision import PARAMETER_NAMES, PredictedPrecision, predicted_precision
from rigidimeter.planning.predicted_record import (
    PredictedRecord,
    expected_record,
    layout,
    noise_covariance,
    noise_spectrum,
    weighted_products,
)
from rigidimeter.planning.search import (
    CRITERIA,
    Candidate,
    assess,
    check_criterion,
    optimise,
    prbs_toml,
    strongest_amplitude_nm,
)
from rigidimeter.planning.study_days import StudyDays, WrongValue, draw_days
