"""Settings of what is computed from an epoch: the estimate, and the scores."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from rigidimeter.settings.section import Section, quantity

__all__ = ["EstimationSettings", "ScoreSettings"]


class EstimationSettings(Section):
    """How J, B and K are estimated from an epoch.

    `band_high_hz` applies where the perturbation is known; `band_high_unknown_hz` where it is not,
    since an imposed motion may excite the joint far above the paper's 10 Hz;
    `band_high_closed_loop_hz` to the methods that weight each frequency by its noise. Higher, they
    gain precision where the subject pushes slowly, and take a soft cuff for the joint.

    `intervals` says how standard errors and intervals are made: "hac" holds for any residual,
    "bootstrap" draws blocks, "white" takes the residual for white within the band.
    """

    band_low_hz: float = quantity(0.15, "Hz", 0.001, 100.0)
    band_high_hz: float = quantity(10.0, "Hz", 0.1, 1000.0)
    band_high_unknown_hz: float = quantity(50.0, "Hz", 0.1, 1000.0)
    band_high_closed_loop_hz: float = quantity(30.0, "Hz", 0.1, 1000.0)
    trim_s: float = quantity(1.0, "s", 0.0, 60.0)
    shortest_epoch_s: float = quantity(5.0, "s", 1.0, 600.0)
    published_highpass_hz: float = quantity(0.2, "Hz", 0.001, 10.0)
    published_highpass_order: int = quantity(2, "1", 1, 6)
    intervals: Literal["hac", "bootstrap", "white"] = "hac"
    bootstrap_draws: int = quantity(999, "1", 100, 100_000)
    correct_delay: bool = True
    longest_delay_s: float = quantity(0.04, "s", 0.001, 0.2)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        highest = min(self.band_high_hz, self.band_high_unknown_hz, self.band_high_closed_loop_hz)
        if self.band_low_hz >= highest:
            raise ValueError(
                "band_low_hz must be below band_high_hz, band_high_unknown_hz and "
                "band_high_closed_loop_hz"
            )
        return self


class ScoreSettings(Section):
    """How the impulse and work scores are computed (Sec. 2.3)."""

    band_low_hz: float = quantity(0.2, "Hz", 0.001, 10.0)
    band_high_hz: float = quantity(5.0, "Hz", 0.1, 100.0)
    cycles: int = quantity(8, "1", 1, 1000)
    discard_s: float = quantity(1.0, "s", 0.0, 60.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.band_low_hz >= self.band_high_hz:
            raise ValueError("band_low_hz must be below band_high_hz")
        return self
