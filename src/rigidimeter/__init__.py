"""Measure joint rigidity with a perturbed, admittance-controlled robot."""

__version__ = "0.1.0"
