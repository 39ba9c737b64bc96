"""What will come of it, before anyone is perturbed: stability, precision, epochs needed."""

from rigidimeter.foresight.foresee import (
    Alternative,
    Detection,
    Foresight,
    Wanted,
    compare_multisine,
    detect,
    foresee,
    planned_epochs,
)
from rigidimeter.foresight.loopmodel import LoopModel, command_response, loop_model, open_loop
from rigidimeter.foresight.motion import ClosedLoopMotion, closed_loop_motion, voluntary_motion_sd
from rigidimeter.foresight.noise import sensor_density, subject_density
from rigidimeter.foresight.optimise import CRITERIA, Candidate, assess, check_criterion, optimise
from rigidimeter.foresight.poles import spectral_radius
from rigidimeter.foresight.power import Effect, SampleSize, epoch_sd, ranksum_power, sample_size
from rigidimeter.foresight.precision import PARAMETERS, Errors, Precision, predicted_precision
from rigidimeter.foresight.stability import (
    Margins,
    Stability,
    loop_margins,
    loop_stability,
    near_instability,
    refuse_unstable,
    subject_joint,
)

__all__ = [
    "CRITERIA",
    "PARAMETERS",
    "Alternative",
    "Candidate",
    "ClosedLoopMotion",
    "Detection",
    "Effect",
    "Errors",
    "Foresight",
    "LoopModel",
    "Margins",
    "Precision",
    "SampleSize",
    "Stability",
    "Wanted",
    "assess",
    "check_criterion",
    "closed_loop_motion",
    "command_response",
    "compare_multisine",
    "detect",
    "epoch_sd",
    "foresee",
    "loop_margins",
    "loop_model",
    "loop_stability",
    "near_instability",
    "open_loop",
    "optimise",
    "planned_epochs",
    "predicted_precision",
    "ranksum_power",
    "refuse_unstable",
    "sample_size",
    "sensor_density",
    "spectral_radius",
    "subject_density",
    "subject_joint",
    "voluntary_motion_sd",
]
