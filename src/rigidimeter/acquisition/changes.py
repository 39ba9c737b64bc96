"""Parameters that may change while the rig runs: few, bounded, and never toward less stability.

A heavier or more damped admittance is more stable, a lighter one less. The protocol's own values
are the ones whose margin was checked, so they are the lower bound. The perturbation may only become
smaller. Changes are bumpless: the velocity, the controller's only memory, stays as it is, and what
follows is limited by the guard like anything else.
"""

from __future__ import annotations

import math
from typing import Any

from rigidimeter.acquisition.control_modes import ControlLoop
from rigidimeter.acquisition.run_states import Order
from rigidimeter.settings import ControllerSettings

__all__ = ["Parameters", "bounds"]

MOST = 10.0


def bounds(name: str, controller: ControllerSettings) -> tuple[float, float]:
    """Return the least and the greatest value that a parameter may take; NaN if it may not change.

    Parameters
    ----------
    name : str
        As the operator typed it.
    controller : ControllerSettings
        Of the protocol.
    """
    if name == "perturbation_scale":
        return 0.0, 1.0
    if name in ("inertia_kg_m2", "damping_nm_s_rad"):
        value = getattr(controller, name)
        return value, MOST * value
    return math.nan, math.nan


class Parameters:
    """The parameters as they are while a session runs.

    Parameters
    ----------
    controller : ControllerSettings
        Of the protocol.
    """

    def __init__(self, controller: ControllerSettings) -> None:
        self._protocol = controller
        self._values = {
            "inertia_kg_m2": controller.inertia_kg_m2,
            "damping_nm_s_rad": controller.damping_nm_s_rad,
        }

    def change(self, order: Order, loop: ControlLoop) -> dict[str, Any]:
        """Change a parameter within its bounds; return what happened, for the record."""
        low, high = bounds(order.name, self._protocol)
        facts = {"name": order.name, "value": order.value if math.isfinite(order.value) else None}
        if not low <= order.value <= high:
            return {**facts, "refused": f"must be between {low:g} and {high:g}"}
        if order.name == "perturbation_scale":
            facts["before"], loop.scale = loop.scale, order.value
        else:
            facts["before"] = self._values[order.name]
            self._values[order.name] = order.value
            loop.change_controller(**self._values)
        return facts
