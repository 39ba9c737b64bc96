"""The experiment before it runs: perturbations, session order, predicted precision, power."""

from rigidimeter.planning.demand import (
    beyond_limits,
    demand,
    ideal_response,
    time_constant_s,
    too_few_cycles,
)
from rigidimeter.planning.design_document import SCHEMA, design_document
from rigidimeter.planning.epochs_needed import (
    Detection,
    Effect,
    Wanted,
    detect,
    epoch_sd,
    planned_epochs,
    ranksum_power,
    sample_size,
)
from rigidimeter.planning.joint_bandwidth import (
    APPENDIX_A,
    CONTROLLER_INERTIA_KG_M2,
    ROBOT_INERTIA_KG_M2,
    Corner,
    Forearm,
    corners,
)
from rigidimeter.planning.multisine import (
    MultisineComparison,
    compare_multisine,
    crest_factor,
    multisine_nm,
    multisine_phases_rad,
)
from rigidimeter.planning.optimise import (
    CRITERIA,
    Candidate,
    assess,
    check_criterion,
    optimise,
    prbs_toml,
    strongest_amplitude_nm,
)
from rigidimeter.planning.overview import Design, design
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
    as_written,
    chip_count,
    period_s,
    prbs_levels,
    prbs_nm,
    sinusoid,
    tick_count,
    tick_times_s,
)
from rigidimeter.planning.precision import PARAMETERS, Precision, predicted_precision
from rigidimeter.planning.predicted_record import (
    Record,
    expected_record,
    layout,
    noise_covariance,
    noise_spectrum,
    weighted_products,
)
from rigidimeter.planning.session_order import draw_rests_s, plan, rest_generator

__all__ = ["design", "prbs_nm"]
