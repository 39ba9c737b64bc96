"""Settings of the perturbations, and of the session that they make up."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from rigidimeter.settings.section import Section, quantity

__all__ = ["BlockSettings", "PrbsSettings", "ProtocolSettings", "SinusoidSettings"]


class PrbsSettings(Section):
    """The torque perturbation: a maximal-length pseudo-random binary sequence."""

    register_bits: int = quantity(7, "1", 3, 20)
    clock_hz: float = quantity(20.0, "Hz", 0.1, 1000.0)
    amplitude_nm: float = quantity(1.0, "N·m", 0.0, 50.0, above=True)
    duration_s: float = quantity(20.0, "s", 1.0, 3600.0)
    wanted_low_hz: float = quantity(0.15, "Hz", 0.001, 100.0)
    wanted_high_hz: float = quantity(10.0, "Hz", 0.01, 500.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.wanted_low_hz >= self.wanted_high_hz:
            raise ValueError("wanted_low_hz must be below wanted_high_hz")
        return self


class SinusoidSettings(Section):
    """The position perturbation for the impulse and work scores."""

    frequency_hz: float = quantity(1.0, "Hz", 0.05, 10.0)
    amplitude_deg: float = quantity(20.0, "deg", 0.1, 90.0)
    motion_s: float = quantity(10.0, "s", 1.0, 600.0)
    duration_s: float = quantity(20.0, "s", 1.0, 3600.0)
    taper_s: float = quantity(1.0, "s", 0.0, 10.0)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.motion_s > self.duration_s:
            raise ValueError("motion_s must not exceed duration_s")
        if 2 * self.taper_s > self.motion_s:
            raise ValueError("taper_s must be at most half of motion_s")
        return self


class BlockSettings(Section):
    """A run of epochs of one task in one condition."""

    task: Literal["prbs", "sinusoid"] = "prbs"
    condition: str = Field("OFF", min_length=1, max_length=40)
    epochs: int = quantity(4, "1", 1, 1000)


class ProtocolSettings(Section):
    """Blocks of epochs in order, with random rests in between.

    With `repeat_limited`, an epoch in which the arm came to a limit is run again at the end, once.
    """

    blocks: list[BlockSettings] = Field(
        default_factory=lambda: [BlockSettings(task="prbs"), BlockSettings(task="sinusoid")],
        min_length=1,
    )
    rests_s: list[float] = Field([10.0, 20.0], min_length=1, json_schema_extra={"unit": "s"})
    return_s: float = quantity(3.0, "s", 0.5, 60.0)
    repeat_limited: bool = False

    @model_validator(mode="after")
    def _rests_hold_the_return(self) -> Self:
        for rest_s in self.rests_s:
            if not self.return_s <= rest_s <= 3600:
                raise ValueError(
                    f"rests_s holds {rest_s:g} s; each rest must last at least return_s "
                    f"({self.return_s:g} s) and at most 3600 s"
                )
        return self
