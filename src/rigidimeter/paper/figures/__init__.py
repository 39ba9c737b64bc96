"""The paper's figures that the report does not draw: arrays in, a matplotlib `Figure` out."""

from rigidimeter.paper.figures.compliance import arm_bode
from rigidimeter.paper.figures.score_sensitivity import sensitivity
from rigidimeter.paper.figures.torque_traces import traces
from rigidimeter.reporting.style import svg_text

__all__ = ["arm_bode", "sensitivity", "svg_text", "traces"]
