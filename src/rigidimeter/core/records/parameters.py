"""The names, symbols and units of J, B and K."""

from __future__ import annotations

from typing import NamedTuple


class Parameter(NamedTuple):
    """A parameter of Eq. 3: its name with the unit in it, its symbol, its unit, and in words."""

    name: str
    symbol: str
    unit: str
    title: str


PARAMETERS = (
    Parameter("inertia_kg_m2", "J", "kg·m²", "inertia"),
    Parameter("damping_nm_s_rad", "B", "N·m·s/rad", "damping"),
    Parameter("stiffness_nm_rad", "K", "N·m/rad", "stiffness"),
)
"""J, B and K in the order of every vector of a `Fit`."""

PARAMETER_VECTORS = {"value": "", "se": "_se", "low": "_low", "high": "_high", "bound": "_bound"}
"""The vectors of a `Fit`, and what their entries are called after the parameter's name."""
