"""What will be commanded, before any hardware: perturbations, their band, and the session."""

from rigidimeter.design.band import DROP_DB, BandCheck, check_band
from rigidimeter.design.bandwidth import APPENDIX_A, Corner, Corners, corners
from rigidimeter.design.demand import Demand, beyond_limits, demand, ideal_response, time_constant_s
from rigidimeter.design.excitation import (
    HALF_POWER_DB,
    Spectrum,
    envelope_db,
    envelope_edge_hz,
    line_spacing_hz,
    plateau_n2m2_hz,
    power_spectrum,
)
from rigidimeter.design.multisine import crest_factor, multisine_nm, multisine_phases_rad
from rigidimeter.design.overview import FREE_ARM, Overview, overview
from rigidimeter.design.prbs import chip_count, period_s, prbs_levels, prbs_nm
from rigidimeter.design.protocol import PlannedEpoch, Protocol, draw_rests_s, plan, rest_generator
from rigidimeter.design.sinusoid import sinusoid

__all__ = [
    "APPENDIX_A",
    "DROP_DB",
    "FREE_ARM",
    "HALF_POWER_DB",
    "BandCheck",
    "Corner",
    "Corners",
    "Demand",
    "Overview",
    "PlannedEpoch",
    "Protocol",
    "Spectrum",
    "beyond_limits",
    "check_band",
    "chip_count",
    "corners",
    "crest_factor",
    "demand",
    "draw_rests_s",
    "envelope_db",
    "envelope_edge_hz",
    "ideal_response",
    "line_spacing_hz",
    "multisine_nm",
    "multisine_phases_rad",
    "overview",
    "period_s",
    "plan",
    "plateau_n2m2_hz",
    "power_spectrum",
    "prbs_levels",
    "prbs_nm",
    "rest_generator",
    "sinusoid",
    "time_constant_s",
]
