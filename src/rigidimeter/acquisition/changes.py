"""Parameters that may change while the rig runs: few, bounded, and never toward less stability.

A heavier or more damped admittance is more stable, a lighter one less. The protocol's own values
are the ones whose margin was checked, so they are the lower bound. The perturbation may only become
smaller. Changes are bumpless: the velocity, the controller's only memory, stays as it is, and what
follows is limited by the guard like anything else.
"""

from __future__ import annotations

import math

from rigidimeter.settings import ControllerSettings

__all__ = ["PARAMETERS", "bounds"]

PARAMETERS = ("inertia_kg_m2", "damping_nm_s_rad", "perturbation_scale")
"""Names in a fixed order: a place in it is what travels between processes."""

MOST = 10.0


def bounds(name: str, controller: ControllerSettings) -> tuple[float, float]:
    """Return the least and the greatest value that a parameter may take; NaN if it may not change.

    Parameters
    ----------
    name : str
        One of `PARAMETERS`.
    controller : ControllerSettings
        Of the protocol.
    """
    if name == "perturbation_scale":
        return 0.0, 1.0
    if name in ("inertia_kg_m2", "damping_nm_s_rad"):
        value = getattr(controller, name)
        return value, MOST * value
    return math.nan, math.nan
