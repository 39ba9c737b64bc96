"""Which epochs and numbers each figure of the report shows, and what it says in words."""

from rigidimeter.report.pictures.base import Picture, representative_fits
from rigidimeter.report.pictures.cohort import (
    day_pictures,
    effect_pictures,
    rating_pictures,
    sensitivity_pictures,
)
from rigidimeter.report.pictures.distributions import distribution_pictures
from rigidimeter.report.pictures.examples import (
    loop_pictures,
    perturbation_pictures,
    torque_pictures,
)
from rigidimeter.report.pictures.frequency import impedance_pictures, voluntary_pictures

__all__ = [
    "Picture",
    "day_pictures",
    "distribution_pictures",
    "effect_pictures",
    "impedance_pictures",
    "loop_pictures",
    "perturbation_pictures",
    "rating_pictures",
    "representative_fits",
    "sensitivity_pictures",
    "torque_pictures",
    "voluntary_pictures",
]
