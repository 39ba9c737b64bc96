"""The methods and their intervals in words."""

from __future__ import annotations

from rigidimeter.estimation.closedloop.refine import ENOUGH_EPOCHS
from rigidimeter.settings import EstimationSettings

__all__ = ["interval_basis", "method_title", "pooled_basis"]

LEAST_SQUARES = ("bandlimited", "published")

_TITLES = {
    "iv": "instrumental variables, made from the perturbation",
    "ml": "maximum likelihood of the torque that the perturbation causes in the whole loop",
    "spectral": "instrumental variables at the lines of a periodic perturbation",
    "bandlimited": "least squares, all signals through one zero-phase band",
    "published": "least squares as the paper prints it",
}

_RESIDUALS = {
    "hac": "a residual of any colour (lowest cosines of the scores, quantiles of Student’s t)",
    "bootstrap": "a residual of any colour (blocks of the epoch drawn again)",
    "white": "a residual that is white within the band, as sensor noise is and voluntary torque "
    "is not",
}


def method_title(method: str) -> str:
    """Return what a method does, or its name where it is not known."""
    return _TITLES.get(method, method)


def interval_basis(method: str, settings: EstimationSettings) -> str:
    """Return what the intervals of a method hold for."""
    if method in LEAST_SQUARES:
        return (
            f"Intervals hold for {_RESIDUALS[settings.intervals]}, and know nothing of bias: a "
            "subject who pushes in a closed loop pulls least squares away from the joint"
        )
    if settings.intervals == "bootstrap":
        return (
            "Intervals are made by giving each spectral line of the residual a new phase, the "
            "subject’s own torque included"
        )
    return (
        "Intervals are made from the power of the residual at each frequency, the subject’s own "
        "torque included"
    )


def pooled_basis(method: str) -> str:
    """Return whether the intervals of all epochs together know that epochs differ."""
    narrow = (
        "the joint is taken for one that does not change, and where epochs differ by more than "
        "their own intervals these are too narrow"
    )
    if method in LEAST_SQUARES:
        return narrow[0].upper() + narrow[1:]
    return (
        f"From {ENOUGH_EPOCHS} epochs on they come from the scatter between epochs; with fewer, "
        f"{narrow}"
    )
