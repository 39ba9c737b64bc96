"""From the values of a column to SI: (value − offset) times a factor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.quantities import BY_STANDARD
from rigidimeter.analysis.reading.channels.unit_text import (
    divided_by,
    expression,
    factor,
    ratio,
    split_number,
)
from rigidimeter.core.errors import UserError

EXAMPLE_ARM = "NUMBER m"


@dataclass(frozen=True)
class Conversion:
    """A column's way to SI.

    Parameters
    ----------
    factor : float
        What 1 of the column's unit is in SI.
    offset : float
        What the column reads at zero, in its own unit.
    """

    factor: float = 1.0
    offset: float = 0.0

    def __call__(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return values in SI; the same array where it is in SI already."""
        with np.errstate(invalid="ignore", over="ignore"):  # what is not finite counts as missing
            if self.offset:
                values = values - self.offset
            return values if self.factor == 1.0 else values * self.factor


def conversion(standard: str, column: str, unit: str, scale: str, offset: str) -> Conversion:
    """Return how a column becomes a stored channel.

    Parameters
    ----------
    standard, column : str
    unit : str
        Of the column's values; nothing where it is not stated and `scale` says it.
    scale, offset : str
        As options give them, or nothing.

    Raises
    ------
    UserError
        If the units do not make the channel's.
    """
    name = BY_STANDARD[standard].name
    below = "" if unit else divided_by(scale)  # "2.5 Nm/V": the column holds V
    found = factor(below, standard, scale) if below else None
    if found is not None:
        unit = below
    else:  # "0.25 rad/s" divides by the second of its own unit
        found = factor(unit, standard, scale)
    if found is None:
        raise UserError(_no_factor(standard, column, unit, scale))
    if found == 0.0:
        raise UserError(f"--scale '{name}={scale}': the number must not be 0")
    if not offset:
        return Conversion(found)
    number, offset_unit = split_number(offset)
    in_own = 1.0 if offset_unit == "" else ratio(offset_unit or "", expression(unit))
    if in_own is not None:
        return Conversion(found, number * in_own)
    in_si = None if offset_unit is None else ratio(offset_unit, BY_STANDARD[standard].si)
    if in_si is None:
        raise UserError(
            f"--offset '{name}={offset}': write what column {column!r} reads at zero, in "
            f"{unit or BY_STANDARD[standard].usual[0]} or {BY_STANDARD[standard].usual[0]}"
        )
    return Conversion(found, number * in_si / found)


def _no_factor(standard: str, column: str, unit: str, scale: str) -> str:
    quantity = BY_STANDARD[standard]
    usual = " or ".join(quantity.usual)
    divisor = f"({unit})" if "/" in unit else unit or "V"
    example = f"--scale '{quantity.name}=NUMBER {quantity.usual[0]}/{divisor}'"
    if expression(unit) and ratio(expression(unit), "newton") is not None:
        example = f"the lever arm, as in --scale '{quantity.name}={EXAMPLE_ARM}'"
    if scale:
        return (
            f"--scale '{quantity.name}={scale}': times the unit of column {column!r} "
            f"({unit or 'not stated'}) this does not make {usual}; write a number and a unit that "
            f"do, as in {example.removeprefix('the lever arm, as in ')}"
        )
    if unit and not expression(unit):
        return (
            f"--unit {quantity.name}={unit}: unknown unit {unit!r}; known for {quantity.name}: "
            f"{', '.join(quantity.usual)} and others"
        )
    return (
        f"column {column!r} is in {unit}, and {quantity.name} is needed in {usual}: say {example}"
    )
