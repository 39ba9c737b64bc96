"""Which epochs and numbers each figure of the report shows, and what it says in words."""

from rigidimeter.reporting.pictures.distributions import distribution_pictures
from rigidimeter.reporting.pictures.examples import (
    loop_pictures,
    perturbation_pictures,
    torque_pictures,
)
from rigidimeter.reporting.pictures.frequency import impedance_pictures, voluntary_pictures
from rigidimeter.reporting.pictures.stored_figure import Picture, representative_fits
from rigidimeter.reporting.pictures.study_figures import (
    day_pictures,
    effect_pictures,
    rating_pictures,
    sensitivity_pictures,
)

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
