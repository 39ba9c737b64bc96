"""The experiment before it runs: perturbations, session order, predicted precision, power."""

from rigidimeter.experiment.demand import (
    Demand,
    beyond_limits,
    demand,
    ideal_response,
    time_constant_s,
)
from rigidimeter.experiment.design_document import SCHEMA, design_document
from rigidimeter.experiment.epochs_needed import (
    Detection,
    Effect,
    Wanted,
    detect,
    epoch_sd,
    planned_epochs,
    ranksum_power,
    sample_size,
)
from rigidimeter.experiment.excitation import (
    HALF_POWER_DB,
    BandCheck,
    Spectrum,
    check_band,
    envelope_db,
    envelope_edge_hz,
    line_spacing_hz,
    plateau_n2m2_hz,
    power_spectrum,
)
from rigidimeter.experiment.joint_bandwidth import APPENDIX_A, Corner, Corners, corners
from rigidimeter.experiment.multisine import (
    MultisineComparison,
    compare_multisine,
    crest_factor,
    multisine_nm,
    multisine_phases_rad,
)
from rigidimeter.experiment.optimise import CRITERIA, Candidate, assess, check_criterion, optimise
from rigidimeter.experiment.overview import Design, design
from rigidimeter.experiment.perturbations import (
    chip_count,
    period_s,
    prbs_levels,
    prbs_nm,
    sinusoid,
)
from rigidimeter.experiment.precision import PARAMETERS, Errors, Precision, predicted_precision
from rigidimeter.experiment.session_order import (
    PlannedEpoch,
    Protocol,
    draw_rests_s,
    plan,
    rest_generator,
)

__all__ = [
    "APPENDIX_A",
    "CRITERIA",
    "HALF_POWER_DB",
    "PARAMETERS",
    "SCHEMA",
    "BandCheck",
    "Candidate",
    "Corner",
    "Corners",
    "Demand",
    "Design",
    "Detection",
    "Effect",
    "Errors",
    "MultisineComparison",
    "PlannedEpoch",
    "Precision",
    "Protocol",
    "Spectrum",
    "Wanted",
    "assess",
    "beyond_limits",
    "check_band",
    "check_criterion",
    "chip_count",
    "compare_multisine",
    "corners",
    "crest_factor",
    "demand",
    "design",
    "design_document",
    "detect",
    "draw_rests_s",
    "envelope_db",
    "envelope_edge_hz",
    "epoch_sd",
    "ideal_response",
    "line_spacing_hz",
    "multisine_nm",
    "multisine_phases_rad",
    "optimise",
    "period_s",
    "plan",
    "planned_epochs",
    "plateau_n2m2_hz",
    "power_spectrum",
    "prbs_levels",
    "prbs_nm",
    "predicted_precision",
    "ranksum_power",
    "rest_generator",
    "sample_size",
    "sinusoid",
    "time_constant_s",
]
