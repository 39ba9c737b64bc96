"""One module for each kind of figure: arrays in, a matplotlib `Figure` out."""

from rigidimeter.report.figures.distribution import distribution
from rigidimeter.report.figures.loop import loop, loop_limits
from rigidimeter.report.figures.perturbation import changes, perturbation, spectrum
from rigidimeter.report.figures.style import condition_colours, condition_markers, styled, svg_text
from rigidimeter.report.figures.torque import torque_limit_nm, torque_parts

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
