"""One module for each kind of figure: arrays in, a matplotlib `Figure` out."""

from rigidimeter.reporting.figures.distribution import distribution
from rigidimeter.reporting.figures.perturbation_figure import changes, perturbation, spectrum
from rigidimeter.reporting.figures.style import (
    condition_colours,
    condition_markers,
    styled,
    svg_text,
)
from rigidimeter.reporting.figures.torque_angle_loop import loop, loop_limits
from rigidimeter.reporting.figures.torque_fit import torque_limit_nm, torque_parts

__all__ = [
    "changes",
    "condition_colours",
    "condition_markers",
    "distribution",
    "loop",
    "loop_limits",
    "perturbation",
    "spectrum",
    "styled",
    "svg_text",
    "torque_limit_nm",
    "torque_parts",
]
