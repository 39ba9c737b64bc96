"""The paper's figures that the report does not draw: arrays in, a matplotlib `Figure` out."""

from rigidimeter.report.figures import svg_text
from rigidimeter.reproduce.figures.bode import arm_bode
from rigidimeter.reproduce.figures.sensitivity import sensitivity
from rigidimeter.reproduce.figures.torque import traces

__all__ = ["arm_bode", "sensitivity", "svg_text", "traces"]
