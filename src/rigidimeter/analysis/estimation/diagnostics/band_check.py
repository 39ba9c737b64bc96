"""Whether the band decides what J, B and K are: neighbouring bands that contradict the interval.

The epochs of a condition are fitted again in bands with other edges
(`closedloop.band_sensitivity`). An estimate is doubted where another band moves a parameter by more
than chance, over all bands and parameters together, by more than a share of the parameter, and by
more than half of half the interval of that estimate: then the interval does not hold what other
frequencies say.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.analysis.estimation.between_epochs import in_full, p_text
from rigidimeter.analysis.estimation.closedloop.band_sensitivity import BandChange
from rigidimeter.analysis.estimation.diagnostics.check_record import half_widths
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import PARAMETERS, BandEstimate, Finding, Fit, Three
from rigidimeter.core.settings import DiagnosticsSettings

NAME = "band_sensitivity"

CHANCE = 0.01
"""Probability of a change by chance, over all bands and parameters of a condition."""

OF_HALF = 0.5
"""A change of less than this share of half an interval is within it."""


def band_estimates(
    condition: str, pooled: Fit | None, values: Array, changes: Sequence[BandChange]
) -> list[BandEstimate]:
    """Return what each band gives, the band of the fit first.

    Parameters
    ----------
    condition : str
    pooled : Fit or None
        The fit to all epochs of the condition, where it was made by the perturbation.
    values : array, shape (3,)
        J, B and K in the band of the fit, in its place.
    changes : sequence of BandChange
    """
    if not changes:
        return []
    at = values if pooled is None else pooled.value
    # Halves of the epochs are of the band of the fit.
    low_hz, high_hz = changes[-1].low_hz, changes[-1].high_hz
    own = BandEstimate(
        condition, low_hz, high_hz, "all", _three(at), (0.0,) * 3, (0.0,) * 3, (1.0,) * 3
    )
    others = [
        BandEstimate(
            condition,
            found.low_hz,
            found.high_hz,
            found.part,
            _three(at + found.change),
            _three(found.change),
            _three(found.change_se),
            _three(found.p),
        )
        for found in changes
    ]
    return [own, *others]


def band_finding(
    fit: Fit, changes: Sequence[BandChange], settings: DiagnosticsSettings
) -> list[Finding]:
    """Return the finding of a fit that another band contradicts; nothing where none does.

    Parameters
    ----------
    fit : Fit
        Of an epoch of the condition, or of all of them.
    changes : sequence of BandChange
    settings : DiagnosticsSettings
    """
    bands = [found for found in changes if found.part == "all"]
    if not bands:
        return []
    change = np.array([found.change for found in bands])
    p = np.minimum(change.size * np.array([found.p for found in bands]), 1.0)  # Bonferroni
    percent = 100 * np.abs(change / fit.value)
    of_half = np.abs(change) / half_widths(fit)
    most = settings.max_band_sensitivity_percent
    contradicting = (p < CHANCE) & (percent > most) & (of_half > OF_HALF)
    if not np.any(contradicting):
        return []
    worst = np.argmax(np.where(contradicting, of_half, 0.0))
    band, parameter = np.unravel_index(worst, change.shape)
    found, about = bands[int(band)], PARAMETERS[int(parameter)]
    own = changes[-1]
    way = "more" if change[band, parameter] * fit.value[parameter] > 0 else "less"
    text = (
        f"from {found.low_hz:.3g} to {found.high_hz:.3g} Hz {about.symbol} is "
        f"{in_full(float(percent[band, parameter]), limit=most)} ± "
        f"{100 * found.change_se[parameter] / abs(fit.value[parameter]):.2g} % {way} than from "
        f"{own.low_hz:.3g} to {own.high_hz:.3g} Hz (at most {most:g} %; by chance "
        f"{p_text(float(p[band, parameter]))}), {of_half[band, parameter]:.2g} times half its "
        "interval: the band decides what the estimate is, as it does where a term is missing"
    )
    return [
        Finding(
            NAME,
            settings.levels.band_sensitivity,
            float(percent[band, parameter]),
            most,
            text,
            "see how J, B and K depend on the band (`sensitivity` in the JSON file, the report’s "
            "figure) and state the band; `rigidimeter model --compare` tries terms",
        )
    ]


def _three(values: Array) -> Three:
    J, B, K = (float(value) for value in values)
    return J, B, K
