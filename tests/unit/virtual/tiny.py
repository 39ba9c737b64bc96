"""A study that runs in seconds: two days, two epochs of each task, short motion."""

from __future__ import annotations

from dataclasses import replace

from rigidimeter.virtual import PAPER, StudyDesign

SHORT = {
    **PAPER.settings,
    "rig": {**PAPER.settings["rig"], "tick_rate_hz": 250.0},
    "prbs": {"register_bits": 6, "duration_s": 5.0},
    "sinusoid": {"duration_s": 5.0, "motion_s": 5.0},
    "scores": {"cycles": 3},
    "estimation": {"min_epoch_s": 3.0, "trim_s": 0.5},
    "zeroing": {"duration_s": 0.1},
}


def tiny(design: StudyDesign = PAPER, *, prbs: int = 2, sinusoid: int = 2) -> StudyDesign:
    """Return the design on two days, with so many epochs of each task in each condition."""
    conditions = tuple(
        replace(condition, days=(1, 2), prbs_epochs=prbs, sinusoid_epochs=sinusoid)
        for condition in design.conditions
    )
    return replace(design, conditions=conditions, settings=SHORT)
