"""The sections of the report, a module for each question of a reviewer."""

from rigidimeter.analysis.report.contents import Section
from rigidimeter.analysis.report.sections import (
    all_tests,
    every_epoch,
    in_short,
    model_fit,
    other_methods,
    rig_and_epochs,
    what_was_done,
)

SECTIONS: list[Section] = [
    *in_short.SECTIONS,
    *what_was_done.SECTIONS,
    *rig_and_epochs.RIG,
    *rig_and_epochs.EPOCHS,
    *model_fit.SECTIONS,
    *other_methods.SECTIONS,
    *all_tests.SECTIONS,
    *rig_and_epochs.PROVENANCE,
    *every_epoch.SECTIONS,
]
"""Every section, a part for each question of a reviewer; append a `Section` to add one."""
