"""Settings of the virtual subject."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from rigidimeter.settings.section import Section, quantity

__all__ = ["SubjectSettings"]


class SubjectSettings(Section):
    """A virtual subject in one condition.

    Each epoch draws J, B and K log-normally about the medians given here, with the coefficients of
    variation given here.
    """

    inertia_kg_m2: float = quantity(0.0045, "kg·m²", 0.0, 10.0, above=True)
    damping_nm_s_rad: float = quantity(0.1368, "N·m·s/rad", 0.0, 100.0)
    stiffness_nm_rad: float = quantity(1.751, "N·m/rad", 0.0, 10000.0)
    inertia_cv_percent: float = quantity(0.0, "%", 0.0, 100.0)
    damping_cv_percent: float = quantity(0.0, "%", 0.0, 100.0)
    stiffness_cv_percent: float = quantity(0.0, "%", 0.0, 100.0)
    voluntary_sd_nm: float = quantity(0.0, "N·m", 0.0, 10.0)
    voluntary_low_hz: float = quantity(0.3, "Hz", 0.01, 20.0)
    voluntary_high_hz: float = quantity(4.0, "Hz", 0.05, 50.0)
    tremor_amplitude_nm: float = quantity(0.0, "N·m", 0.0, 10.0)
    tremor_frequency_hz: float = quantity(5.0, "Hz", 1.0, 20.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.voluntary_low_hz >= self.voluntary_high_hz:
            raise ValueError("voluntary_low_hz must be below voluntary_high_hz")
        return self
