"""The studies that pages are tested with."""

from tests.unit.analysis.report.conftest import (  # noqa: F401
    epochs,
    make_analysis,
    make_study,
    study,
)
