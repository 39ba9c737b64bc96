"""The sections of the report, one module for each figure or group of tables."""

from dataclasses import replace

from rigidimeter.analysis.report.contents import Section
from rigidimeter.analysis.report.sections import (
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
    rating_scatter,
    recorded_signals,
    recordings,
    study_overview,
    torque_angle_loop,
    torque_fit,
    unexplained_torque,
)


def _part(title: str, *sections: Section, printed: int = 0) -> list[Section]:
    """Return the sections of a part; the first ones are printed."""
    return [
        replace(section, part=title, printed=place < printed)
        for place, section in enumerate(sections)
    ]


SECTIONS: list[Section] = [
    *_part(
        "Summary",
        study_overview.NUMBERS,
        study_overview.OVERVIEW,
        study_overview.CHANGES,
        printed=2,
    ),
    *_part(
        "Measures",
        comparison_tables.COMPARISON,
        comparison_tables.RESULTS,
        forest.SECTION,
        day_points.SECTION,
        distribution.SECTION,
        comparison_tables.ALL_EPOCHS,
        printed=5,
    ),
    *_part("Ratings", rating_points.SECTION, rating_scatter.SECTION, printed=2),
    *_part("What rests on the method", method_sensitivity.SECTION, other_bands.SECTION),
    *_part("Joint over frequency", impedance.SECTION, unexplained_torque.SECTION),
    *_part(
        "Examples",
        recorded_signals.SECTION,
        torque_fit.SECTION,
        torque_angle_loop.SECTION,
        perturbation_figure.SECTION,
    ),
    *_part("Quality", data_quality.FINDINGS, recordings.NOTICES, printed=2),
    *_part("Exclusions", data_quality.STUDY_EXCLUSIONS, data_quality.EXCLUSIONS),
    *_part(
        "Methods", methods_prose.SECTION, recordings.ABOUT, estimate_tables.ESTIMATION, printed=1
    ),
    *_part("Settings and provenance", recordings.DESIGN, recordings.PROVENANCE),
    *_part("Tables", estimate_tables.EPOCHS),
]
"""Every section in the order of the page; append a `Section` to add one."""
