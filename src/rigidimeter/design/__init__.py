"""What will be commanded, before any hardware: perturbations, their band, and the session."""

from rigidimeter.design.band import DROP_DB, BandCheck, check_band
from rigidimeter.design.bandwidth import APPENDIX_A, Corner, Corners, corners
from rigidimeter.design.demand import (
    Demand,
    beyond_limits,
    demand,
    ideal_response,
    time_constant_s,
)
from rigidimeter.design.excitation import (
    HALF_POWER_DB,
    Spectrum,
    envelope_db,
    envelope_edge_hz,
    line_spacing_hz,
    plateau_n2m2_hz,
    power_spectrum,
)
from rigidimeter.design.foresight import (
    Alternative,
    Detection,
    Foresight,
    Wanted,
    compare_multisine,
    detect,
    foresee,
    planned_epochs,
)
from rigidimeter.design.loopmodel import LoopModel, command_response, loop_model, open_loop
from rigidimeter.design.motion import ClosedLoopMotion, closed_loop_motion, voluntary_motion_sd
from rigidimeter.design.multisine import crest_factor, multisine_nm, multisine_phases_rad
from rigidimeter.design.noise import sensor_density, subject_density
from rigidimeter.design.optimise import CRITERIA, Candidate, assess, check_criterion, optimise
from rigidimeter.design.overview import FREE_ARM, Overview, overview
from rigidimeter.design.poles import spectral_radius
from rigidimeter.design.power import Effect, SampleSize, epoch_sd, ranksum_power, sample_size
from rigidimeter.design.prbs import chip_count, period_s, prbs_levels, prbs_nm
from rigidimeter.design.precision import PARAMETERS, Errors, Precision, predicted_precision
from rigidimeter.design.protocol import (
    PlannedEpoch,
    Protocol,
    draw_rests_s,
    plan,
    rest_generator,
)
from rigidimeter.design.sinusoid import sinusoid
from rigidimeter.design.stability import (
    Margins,
    Stability,
    loop_margins,
    loop_stability,
    near_instability,
    refuse_unstable,
    subject_joint,
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
    "ClosedLoopMotion",
    "Corner",
    "Corners",
    "Demand",
    "Detection",
    "Effect",
    "Errors",
    "Foresight",
    "LoopModel",
    "Margins",
    "Overview",
    "PlannedEpoch",
    "Precision",
    "Protocol",
    "SampleSize",
    "Spectrum",
    "Stability",
    "Wanted",
    "assess",
    "beyond_limits",
    "check_band",
    "check_criterion",
    "chip_count",
    "closed_loop_motion",
    "command_response",
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
    "loop_margins",
    "loop_model",
    "loop_stability",
    "multisine_nm",
    "multisine_phases_rad",
    "near_instability",
    "open_loop",
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
    "refuse_unstable",
    "rest_generator",
    "sample_size",
    "sensor_density",
    "sinusoid",
    "spectral_radius",
    "subject_density",
    "subject_joint",
    "time_constant_s",
    "voluntary_motion_sd",
]
