"""Settings of the live estimate."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from rigidimeter.settings.section import Section, quantity

__all__ = ["OnlineSettings"]


class OnlineSettings(Section):
    """The band of the causal filters, and how long the live estimate remembers.

    A sample counts 1/e after `forgetting_s`; a step of a parameter is followed from 10 to 90 % in
    2.2 times that. Motion with less than `rest_share_percent` of its usual power teaches nothing,
    and then nothing is forgotten either.
    """

    band_low_hz: float = quantity(0.15, "Hz", 0.001, 100.0)
    band_high_hz: float = quantity(10.0, "Hz", 0.1, 1000.0)
    forgetting_s: float = quantity(5.0, "s", 0.05, 3600.0)
    rest_share_percent: float = quantity(1.0, "%", 0.0, 50.0)
    rest_window_s: float = quantity(0.5, "s", 0.01, 60.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.band_low_hz >= self.band_high_hz:
            raise ValueError("band_low_hz must be below band_high_hz")
        return self
