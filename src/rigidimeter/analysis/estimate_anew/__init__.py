"""From epochs to J, B and K, to scores, and to what else the torque holds: offline and pure."""

from rigidimeter.analysis.estimate_anew.answer import Answer, answer
from rigidimeter.analysis.estimate_anew.checks import Pull, at_least, at_most, found
from rigidimeter.analysis.estimate_anew.delay import aligned
from rigidimeter.analysis.estimate_anew.estimate import (
    CHECKS,
    METHODS,
    Impedance,
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
from rigidimeter.analysis.estimate_anew.grid import Array
from rigidimeter.analysis.estimate_anew.methods import Method, Ready
from rigidimeter.analysis.estimate_anew.models import (
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
from rigidimeter.analysis.estimate_anew.published import (
    epoch_signals,
    fit_inertia_damping_stiffness,
)
from rigidimeter.analysis.estimate_anew.scores import (
    Cycles,
    find_motion,
    loop_area_j,
    score_epoch,
    scoring_cycles,
)
from rigidimeter.analysis.estimate_anew.signals import Signals, band_hz, zero_phase_band
from rigidimeter.analysis.estimate_anew.stretches import longest_part
from rigidimeter.analysis.estimate_anew.terms import TERMS, Term
