"""Models as sums of terms by name: fit, predict, compare."""

from rigidimeter.estimation.terms.catalogue import GROUPS, REFLEXES, TERMS, Term, parse_terms
from rigidimeter.estimation.terms.model_comparison import (
    BASE,
    Comparison,
    ModelRow,
    candidates,
    compare_models,
)
from rigidimeter.estimation.terms.reflex import REFLEX_KINDS
from rigidimeter.estimation.terms.residual_tests import ResidualTest, residual_test
from rigidimeter.estimation.terms.term_fit import (
    Parameter,
    Prediction,
    TermsFit,
    fit_terms,
    predict,
)
from rigidimeter.estimation.terms.wideband_motion import (
    Motion,
    motion_from_epoch,
    motion_from_position,
    split,
)

__all__ = [
    "BASE",
    "GROUPS",
    "REFLEXES",
    "REFLEX_KINDS",
    "TERMS",
    "Comparison",
    "ModelRow",
    "Motion",
    "Parameter",
    "Prediction",
    "ResidualTest",
    "Term",
    "TermsFit",
    "candidates",
    "compare_models",
    "fit_terms",
    "motion_from_epoch",
    "motion_from_position",
    "parse_terms",
    "predict",
    "residual_test",
    "split",
]
