"""The figures of the maintainers' measured tables, drawn from these as they stand in the pages.

Nothing is measured for them, so a figure says what its table says.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from matplotlib.figure import Figure
from tests.docs import figures_of_estimates, figures_of_studies, figures_of_the_guard
from tests.docs.measured import DEVELOPMENT

FOLDER = DEVELOPMENT / "figures"
METHODS = ("iv", "bandlimited", "blind")
FIGURES: Mapping[str, Callable[[], Figure]] = {
    **{
        f"scenarios-{method}": partial(figures_of_estimates.scenarios, method) for method in METHODS
    },
    "late-drive": figures_of_estimates.late_drive,
    "between-samples": figures_of_estimates.between_samples,
    "other-drives": figures_of_estimates.other_drives,
    "guard-times": figures_of_the_guard.guard_times,
    "guard-torque": partial(figures_of_the_guard.stopped, "fault"),
    "guard-untrue": partial(figures_of_the_guard.stopped, "what is wrong"),
    "calibration": figures_of_studies.calibration,
    "coverage": figures_of_estimates.coverage,
    "intervals": figures_of_estimates.intervals,
    "verdicts": figures_of_studies.verdicts,
    "speed": figures_of_studies.speed,
}
