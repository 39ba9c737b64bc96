"""Settings of what is foreseen before anyone is perturbed: margins, search, multisine."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from rigidimeter.settings.section import Section, quantity

__all__ = ["MarginsSettings", "MultisineSettings", "OptimiseSettings"]


class MarginsSettings(Section):
    """How far the loop must stay from instability, and for which joints.

    Each of J, B and K of every subject is varied by the two factors to find the worst case. A loop
    that is unstable or has smaller margins is refused for a condition's own joint, and brings a
    warning for the worst case.
    """

    gain_margin_db: float = quantity(6.0, "dB", 0.0, 60.0)
    phase_margin_deg: float = quantity(30.0, "deg", 0.0, 90.0)
    joint_factor_low: float = quantity(0.25, "1", 0.01, 1.0)
    joint_factor_high: float = quantity(4.0, "1", 1.0, 100.0)


class OptimiseSettings(Section):
    """Where `design --optimise` looks for a better PRBS.

    The amplitude of each candidate is the largest that keeps `limit_margin_percent` of the guard's
    limits in hand, and at most `amplitude_high_nm`.
    """

    clock_low_hz: float = quantity(5.0, "Hz", 0.1, 1000.0)
    clock_high_hz: float = quantity(60.0, "Hz", 0.1, 1000.0)
    clocks: int = quantity(9, "1", 1, 100)
    bits_low: int = quantity(5, "1", 3, 20)
    bits_high: int = quantity(10, "1", 3, 20)
    amplitude_high_nm: float = quantity(3.0, "N·m", 0.0, 50.0, above=True)
    limit_margin_percent: float = quantity(20.0, "%", 0.0, 90.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.clock_low_hz > self.clock_high_hz:
            raise ValueError("clock_low_hz must not be above clock_high_hz")
        if self.bits_low > self.bits_high:
            raise ValueError("bits_low must not be above bits_high")
        return self


class MultisineSettings(Section):
    """A multisine in place of the PRBS: equal lines at whole multiples of 1 / `period_s`.

    It lies in the wanted band of `[prbs]`, lasts as long, and has the same peak torque.
    """

    period_s: float = quantity(20.0, "s", 0.1, 3600.0)
    phases: Literal["schroeder", "random"] = "schroeder"
    crest_steps: int = quantity(200, "1", 0, 10000)
