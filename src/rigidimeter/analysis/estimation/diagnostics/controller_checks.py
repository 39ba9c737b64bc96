"""Whether the controller of the settings can be the one that moved the joint.

Where the command was recorded it is held against what that controller makes of perturbation and
torque (`controller_used`); and a loop that would be unstable with the joint that was estimated
cannot have moved it.

Neither biases a method whose instruments are made from the perturbation: whatever the controller,
they follow from the perturbation alone. Least squares is biased by the loop that really was, so the
bias that `loop_bias` tells is computed with the controller that the recording shows.
"""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.closedloop.controller_used import (
    controller_shown,
    loop_shown,
    misfit_of_settings,
)
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    HARMFUL,
    Case,
    Check,
    Harmless,
    Look,
    at_most,
    push_harmless,
)
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.settings import ControllerSettings, Settings
from rigidimeter.core.units import per_rad_from_per_deg
from rigidimeter.model import JointDynamics, spectral_radius

PER_DEGREE_WITHIN = 1.5
"""Values that are wrong by 57.3, within this factor, were given per degree."""


def controller_misfit(prepared: PreparedEpoch) -> Look | None:
    """Return how far the command is from what the controller makes of perturbation and torque."""
    misfit = prepared.once(misfit_of_settings)
    if misfit is None or np.isnan(misfit[0]):
        return None
    value, factor = misfit
    most = prepared.settings.diagnostics.max_controller_misfit_percent
    look = at_most(value, most, factor=factor)
    loop = loop_shown(prepared)
    shown = controller_shown(prepared, loop) if look.failed else None
    if shown is None:
        return look
    facts = {
        "shown_inertia": shown.inertia_kg_m2,
        "shown_damping": shown.damping_nm_s_rad,
        **look.facts,
    }
    return look._replace(facts=facts, variant=_how_shown(loop.controller, shown))


def unstable_loop(parameters: Array, prepared: PreparedEpoch) -> Look | None:
    """Return the growth per second of the loop of the settings with the joint that was found."""
    if not np.all(parameters >= 0):
        return None  # no such joint
    loop = loop_shown(prepared)
    settings = Settings().model_copy(update={"controller": loop.controller, "rig": loop.rig})
    radius = spectral_radius(settings, JointDynamics(*parameters.tolist()))
    value = float(np.log(max(radius, 1e-12))) * loop.rig.tick_rate_hz
    return at_most(value, 0.0)


def _how_shown(given: ControllerSettings, shown: ControllerSettings) -> str:
    """Return the variant that says how the settings differ from the controller that was used."""
    per_deg = per_rad_from_per_deg(1.0)
    heavier = shown.inertia_kg_m2 / given.inertia_kg_m2
    factors = np.array([heavier, shown.damping_nm_s_rad / max(given.damping_nm_s_rad, 1e-12)])
    for wrong, variant in ((per_deg, "per_degree"), (1.0 / per_deg, "per_degree_twice")):
        if np.all(np.abs(np.log(factors / wrong)) < np.log(PER_DEGREE_WITHIN)):
            return variant
    return "shown"


def _harmless(case: Case, look: Look) -> Harmless:
    """Return why a wrong controller does not bias the estimate; `HARMFUL` where it does."""
    # Of a loop that is not known the bias cannot be told.
    return push_harmless(case, look) if case.uses_perturbation or look.variant else HARMFUL


CONTROLLER_CHECKS = (
    Check(
        "controller_misfit",
        ("velocity_command_rad_s", "perturbation_nm"),
        lambda c: controller_misfit(c.prepared) if c.prepared is not None else None,
        of_fit=False,
        harmless=_harmless,
    ),
    Check(
        "unstable_loop",
        ("perturbation_nm",),
        lambda c: unstable_loop(c.parameters, c.prepared) if c.prepared is not None else None,
        harmless=push_harmless,
    ),
)
