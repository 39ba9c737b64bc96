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
        day_points.SECTION,
        data_quality.FINDINGS,
        study_overview.OVERVIEW,
        study_overview.CHANGES,
        printed=4,
    ),
    *_part(
        "What was done",
        methods_prose.SECTION,
        recordings.ABOUT,
        recordings.DESIGN,
        perturbation_figure.SECTION,
        printed=1,
    ),
    *_part("Was the rig right", recordings.NOTICES, estimate_tables.ESTIMATION, printed=1),
    *_part(
        "Were the epochs good",
        data_quality.STUDY_EXCLUSIONS,
        data_quality.EXCLUSIONS,
        recorded_signals.SECTION,
        printed=1,
    ),
    *_part(
        "Does the model fit",
        torque_fit.SECTION,
        impedance.SECTION,
        unexplained_torque.SECTION,
        torque_angle_loop.SECTION,
        printed=1,
    ),
    *_part("Does the method matter", method_sensitivity.SECTION, other_bands.SECTION, printed=1),
    *_part(
        "All tests",
        comparison_tables.COMPARISON,
        comparison_tables.RESULTS,
        forest.SECTION,
        distribution.SECTION,
        comparison_tables.ALL_EPOCHS,
        rating_points.SECTION,
        rating_scatter.SECTION,
        printed=4,
    ),
    *_part("Provenance", recordings.PROVENANCE),
    *_part("Tables", estimate_tables.EPOCHS),
]
"""Every section, a part for each question of a reviewer; append a `Section` to add one."""
