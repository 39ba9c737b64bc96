"""From epochs to J, B and K, to scores, and to what else the torque holds: offline and pure.

Code from outside adds to `METHODS`, `CHECKS` and `TERMS`; a term's columns are made of a `Motion`.
`chance` is the p value of what else the torque holds, `between_epochs` compares fits.
"""

from rigidimeter.analysis.estimation.between import between_epochs
from rigidimeter.analysis.estimation.checks import at_most
from rigidimeter.analysis.estimation.delay import aligned
from rigidimeter.analysis.estimation.estimate import (
    CHECKS,
    METHODS,
    Progress,
    Recorded,
    choose_method,
    estimate,
    estimate_recorded,
    fit_epoch,
    impedance,
    method_named,
    method_names,
    no_such_method,
    observations_of,
    prepare,
    task_of,
)
from rigidimeter.analysis.estimation.grid import Array
from rigidimeter.analysis.estimation.methods import Method, Ready
from rigidimeter.analysis.estimation.models import (
    Comparison,
    ModelRow,
    TermsFit,
    better_clock,
    candidates,
    compare_models,
    fit_models,
    from_zero,
    parse_terms,
    refusal,
    term_names,
)
from rigidimeter.analysis.estimation.published import (
    epoch_signals,
    fit_inertia_damping_stiffness,
)
from rigidimeter.analysis.estimation.score import chance
from rigidimeter.analysis.estimation.scores import (
    Cycles,
    loop_area_j,
    score_epoch,
    scoring_cycles,
)
from rigidimeter.analysis.estimation.signals import Signals, zero_phase_band
from rigidimeter.analysis.estimation.stretches import longest_part
from rigidimeter.analysis.estimation.terms import TERMS, Motion, Term
