"""Checks on an epoch and its fit, each a pure function from numbers to a `Finding`."""

from rigidimeter.estimation.diagnostics.channels import (
    frozen,
    guard_limited,
    position_limit,
    saturation,
)
from rigidimeter.estimation.diagnostics.diagnose import checked, diagnose, summary
from rigidimeter.estimation.diagnostics.excitation_checks import (
    band_share,
    coherence,
    conditioning,
    imposed_sinusoid,
)
from rigidimeter.estimation.diagnostics.kinematics import (
    velocity_delay,
    velocity_fit,
    velocity_scale,
)
from rigidimeter.estimation.diagnostics.movement import (
    active_movement,
    active_seconds,
    emg_activity,
    emg_envelope_v,
    reconstructed_torque_nm,
    voluntary_torque,
)
from rigidimeter.estimation.diagnostics.parameters import (
    implausible_parameters,
    negative_parameters,
)
from rigidimeter.estimation.diagnostics.residuals import (
    held_out_vaf,
    residual_perturbation,
    residual_whiteness,
)

__all__ = [
    "active_movement",
    "active_seconds",
    "band_share",
    "checked",
    "coherence",
    "conditioning",
    "diagnose",
    "emg_activity",
    "emg_envelope_v",
    "frozen",
    "guard_limited",
    "held_out_vaf",
    "implausible_parameters",
    "imposed_sinusoid",
    "negative_parameters",
    "position_limit",
    "reconstructed_torque_nm",
    "residual_perturbation",
    "residual_whiteness",
    "saturation",
    "summary",
    "velocity_delay",
    "velocity_fit",
    "velocity_scale",
    "voluntary_torque",
]
