"""Models as sums of terms by name: fit, predict, compare."""

from rigidimeter.analysis.estimation.terms.catalogue import TERMS, Term, parse_terms, term_names
from rigidimeter.analysis.estimation.terms.model_comparison import (
    Comparison,
    ModelRow,
    candidates,
    compare_models,
    fit_model,
    fit_models,
)
from rigidimeter.analysis.estimation.terms.term_fit import TermsFit, fit_terms
from rigidimeter.analysis.estimation.terms.wideband import wideband_from_angle, wideband_signals

__all__ = [
    "TERMS",
    "Comparison",
    "ModelRow",
    "Term",
    "TermsFit",
    "candidates",
    "compare_models",
    "fit_model",
    "fit_models",
    "fit_terms",
    "parse_terms",
    "term_names",
    "wideband_from_angle",
    "wideband_signals",
]
