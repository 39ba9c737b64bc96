"""What is compared: each measure described once, and the values that count."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from rigidimeter.records import Analysis, Fit, Score

__all__ = ["MEASURES", "RATING", "Measure", "Observation"]


@dataclass(frozen=True)
class Measure:
    """What is compared.

    Attributes
    ----------
    name : str
        Stored name with unit, for example ``damping_nm_s_rad``.
    title, unit : str
        For people, for example ``Viscous damping B`` and ``N·m·s/rad``.
    origin : str
        Where its values come from: a field of an analysis, examiners' ratings, or the column of a
        table.
    """

    name: str
    title: str
    unit: str
    origin: Literal["fits", "fixed_inertia", "scores", "ratings", "column"]

    def results(self, analysis: Analysis) -> Sequence[Fit | Score]:
        """Return the fits or scores that hold this measure."""
        if self.origin in ("ratings", "column"):
            return ()
        found: Sequence[Fit | Score] = getattr(analysis, self.origin)
        return found

    @property
    def label(self) -> str:
        """Title and unit, for axes and headings."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    @property
    def counted(self) -> str:
        """What one value is, in the plural."""
        return {"ratings": "ratings", "column": "values"}.get(self.origin, "epochs")


MEASURES = (
    Measure("inertia_kg_m2", "Inertia J", "kg·m²", "fits"),
    Measure("damping_nm_s_rad", "Viscous damping B", "N·m·s/rad", "fixed_inertia"),
    Measure("stiffness_nm_rad", "Stiffness K", "N·m/rad", "fixed_inertia"),
    Measure("impulse_nm_s", "Angular impulse", "N·m·s", "scores"),
    Measure("work_j", "Work", "J", "scores"),
)
"""Inertia is from the first stage; damping and stiffness are from the second, at fixed inertia."""

RATING = Measure("rating", "Examiners' rating", "1", "ratings")
"""Scores less the offsets of their examiners."""


@dataclass(frozen=True)
class Observation:
    """One value of a measure that counts.

    Attributes
    ----------
    value, low, high : float
        With the ends of its own 95 % interval, NaN where it has none.
    condition, subject, day, source, epoch : str
        Empty where unknown.
    unit : str
        What the bootstrap resamples: a day of a subject, a session, or the value itself.
    """

    value: float
    condition: str
    subject: str = ""
    day: str = ""
    source: str = ""
    epoch: str = ""
    unit: str = ""
    low: float = math.nan
    high: float = math.nan
