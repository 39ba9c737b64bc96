"""How a section of the settings is declared: strict, frozen, every number with its unit."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


def quantity(default: float, unit: str, low: float, high: float, *, above: bool = False) -> Any:
    """Declare a number with its unit and range.

    Parameters
    ----------
    default : float
        The value when the key is absent.
    unit : str
        The unit, for messages; ``"1"`` for a pure number.
    low, high : float
        The allowed range, both ends included unless `above`.
    above : bool
        The value must be greater than `low`.
    """
    lower: dict[str, Any] = {"gt": low} if above else {"ge": low}
    return Field(default, **lower, le=high, json_schema_extra={"unit": unit})


class Section(BaseModel):
    """One table of the settings: no unknown keys, no silent conversions, no changes afterwards."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, validate_default=True
    )
