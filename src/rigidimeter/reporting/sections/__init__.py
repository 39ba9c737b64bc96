"""The sections of the report, one module for each figure or group of tables."""

from rigidimeter.reporting.contents import Section, from_study_folder
from rigidimeter.reporting.sections import (
    comparison_tables,
    data_quality,
    day_points,
    distribution,
    estimate_tables,
    forest,
    impedance,
    method_sensitivity,
    methods_prose,
    other_bands,
    perturbation_figure,
    rating_points,
    recordings,
    study_overview,
    torque_angle_loop,
    torque_fit,
    unexplained_torque,
)

__all__ = ["SECTIONS"]

SECTIONS: list[Section] = [
    study_overview.OVERVIEW,
    comparison_tables.COMPARISON,
    forest.SECTION,
    day_points.SECTION,
    rating_points.SECTION,
    data_quality.STUDY_EXCLUSIONS,
    method_sensitivity.SECTION,
    study_overview.CHANGES,
    methods_prose.SECTION,
    Section("recordings", "The recordings", lambda _: (), from_study_folder),
    recordings.ABOUT,
    recordings.DESIGN,
    estimate_tables.ESTIMATION,
    comparison_tables.RESULTS,
    comparison_tables.ALL_EPOCHS,
    distribution.SECTION,
    perturbation_figure.SECTION,
    impedance.SECTION,
    torque_fit.SECTION,
    unexplained_torque.SECTION,
    other_bands.SECTION,
    torque_angle_loop.SECTION,
    data_quality.FINDINGS,
    data_quality.EXCLUSIONS,
    recordings.NOTICES,
    estimate_tables.EPOCHS,
    recordings.PROVENANCE,
]
"""Every section in the order of the page; append a `Section` to add one.

A section without blocks is the heading of those that follow.
"""
