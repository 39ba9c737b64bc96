"""Models as sums of terms by name: fit, predict, compare."""

from rigidimeter.estimation.terms.catalogue import TERMS, Term, parse_terms, term_names
from rigidimeter.estimation.terms.model_comparison import (
    Comparison,
    EpochModels,
    ModelRow,
    candidates,
    compare_models,
    fit_model,
    model_epoch,
)
from rigidimeter.estimation.terms.term_fit import TermsFit, fit_terms, predicted_vaf_percent
from rigidimeter.estimation.terms.wideband import wideband_from_angle, wideband_signals

__all__ = [
    "TERMS",
    "Comparison",
    "EpochModels",
    "ModelRow",
    "Term",
    "TermsFit",
    "candidates",
    "compare_models",
    "fit_model",
    "fit_terms",
    "model_epoch",
    "parse_terms",
    "predicted_vaf_percent",
    "term_names",
    "wideband_from_angle",
    "wideband_signals",
]
