"""J, B and K as they come out of another band, or another part of the epochs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rigidimeter.core.records.parameters import PARAMETERS

Three = tuple[float, float, float]

BAND_VECTORS = {"value": "", "change": "_change", "change_se": "_change_se", "p": "_p"}
"""What is known of each parameter, and how the names of it end in files and tables."""


@dataclass(frozen=True)
class BandEstimate:
    """J, B and K of all epochs of a condition together, from one band and part of the epochs.

    Attributes
    ----------
    condition : str
    low_hz, high_hz : float
    part : str
        ``all``, or ``first half`` or ``second half`` of each epoch.
    value : (float, float, float)
        In the order of `PARAMETERS`.
    change, change_se : (float, float, float)
        From the estimate in the band of the fit, and the standard error of that difference.
    p : (float, float, float)
        Probability of as large a change by chance; 1 for the band of the fit.
    """

    condition: str
    low_hz: float
    high_hz: float
    part: str
    value: Three
    change: Three
    change_se: Three
    p: Three

    @property
    def of_fit(self) -> bool:
        """Whether this is the estimate that the others are held against."""
        return self.change_se == (0.0, 0.0, 0.0)

    def row(self) -> dict[str, Any]:
        """Return names and numbers, as files and tables have them."""
        numbers = {
            parameter.name + ending: getattr(self, vector)[i]
            for i, parameter in enumerate(PARAMETERS)
            for vector, ending in BAND_VECTORS.items()
        }
        where = {name: getattr(self, name) for name in ("condition", "low_hz", "high_hz", "part")}
        return where | numbers
