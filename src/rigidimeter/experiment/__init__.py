"""The experiment before it runs: perturbations, session order, predicted precision, power."""

from rigidimeter.experiment.band import DROP_DB, BandCheck, check_band
from rigidimeter.experiment.demand import (
    Demand,
    beyond_limits,
    demand,
    ideal_response,
    time_constant_s,
)
from rigidimeter.experiment.epochs_needed import (
    Effect,
    SampleSize,
    epoch_sd,
    ranksum_power,
    sample_size,
)
from rigidimeter.experiment.joint_bandwidth import APPENDIX_A, Corner, Corners, corners
from rigidimeter.experiment.multisine import crest_factor, multisine_nm, multisine_phases_rad
from rigidimeter.experiment.optimise import CRITERIA, Candidate, assess, check_criterion, optimise
from rigidimeter.experiment.overview import FREE_ARM, Overview, overview
from rigidimeter.experiment.perturbation_spectrum import (
    HALF_POWER_DB,
    Spectrum,
    envelope_db,
    envelope_edge_hz,
    line_spacing_hz,
    plateau_n2m2_hz,
    power_spectrum,
)
from rigidimeter.experiment.position_sinusoid import sinusoid
from rigidimeter.experiment.prbs import chip_count, period_s, prbs_levels, prbs_nm
from rigidimeter.experiment.precision import PARAMETERS, Errors, Precision, predicted_precision
from rigidimeter.experiment.prediction import (
    Alternative,
    Detection,
    Foresight,
    Wanted,
    compare_multisine,
    detect,
    foresee,
    planned_epochs,
)
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
    "DROP_DB",
    "FREE_ARM",
    "HALF_POWER_DB",
    "PARAMETERS",
    "Alternative",
    "BandCheck",
    "Candidate",
    "Corner",
    "Corners",
    "Demand",
    "Detection",
    "Effect",
    "Errors",
    "Foresight",
    "Overview",
    "PlannedEpoch",
    "Precision",
    "Protocol",
    "SampleSize",
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
    "detect",
    "draw_rests_s",
    "envelope_db",
    "envelope_edge_hz",
    "epoch_sd",
    "foresee",
    "ideal_response",
    "line_spacing_hz",
    "multisine_nm",
    "multisine_phases_rad",
    "optimise",
    "overview",
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
