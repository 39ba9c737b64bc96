"""The experiment before it runs: perturbations, session order, predicted precision, power."""

from rigidimeter.experiment.demand import demand, ideal_response, time_constant_s, too_few_cycles
from rigidimeter.experiment.design_document import design_document
from rigidimeter.experiment.epochs_needed import (
    Detection,
    Effect,
    Wanted,
    detect,
    ranksum_power,
    sample_size,
)
from rigidimeter.experiment.joint_bandwidth import APPENDIX_A, Corner, Forearm, corners
from rigidimeter.experiment.multisine import MultisineComparison, compare_multisine, multisine_nm
from rigidimeter.experiment.optimise import Candidate, check_criterion, optimise, prbs_toml
from rigidimeter.experiment.overview import Design, design
from rigidimeter.experiment.perturbation_band import check_band, power_spectrum
from rigidimeter.experiment.perturbations import (
    chip_count,
    period_s,
    prbs_levels,
    prbs_nm,
    sinusoid,
)
from rigidimeter.experiment.precision import PARAMETERS, Precision, predicted_precision
from rigidimeter.experiment.session_order import PlannedEpoch, Protocol, plan

__all__ = ["design", "prbs_nm"]
