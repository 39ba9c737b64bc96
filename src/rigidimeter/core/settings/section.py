"""How a section of the settings is declared: strict, frozen, every number with its unit."""

from __future__ import annotations

from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator


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
    """One table of the settings: no unknown keys, no silent conversions, no changes afterwards.

    Of each pair of keys in `ascending` the first must be below the second.
    """

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, validate_default=True
    )
    ascending: ClassVar[tuple[tuple[str, str], ...]] = ()

    @model_validator(mode="after")
    def _ascends(self) -> Self:
        for low, high in self.ascending:
            if getattr(self, low) >= getattr(self, high):
                raise ValueError(f"{low} must be below {high}")
        return self
