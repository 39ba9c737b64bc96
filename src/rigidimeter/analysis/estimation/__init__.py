"""From an epoch to numbers: offline and pure.

Each name is imported when it is first used: the estimator that runs beside a session needs one
module, and would otherwise load scipy while the arm is about to move.
"""

from typing import TYPE_CHECKING

from rigidimeter.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from rigidimeter.analysis.estimation.alignment import aligned, estimate_delays
    from rigidimeter.analysis.estimation.amplitude import amplitude_of_signals
    from rigidimeter.analysis.estimation.bandlimited import band_hz
    from rigidimeter.analysis.estimation.least_squares import fit_inertia_damping_stiffness
    from rigidimeter.analysis.estimation.method_record import Method
    from rigidimeter.analysis.estimation.methods import (
        METHODS,
        choose_method,
        epoch_signals,
        fit_epoch,
        fit_epochs,
        method_named,
        method_names,
        no_such_method,
    )
    from rigidimeter.analysis.estimation.scores import (
        Cycles,
        find_motion,
        score_epoch,
        scoring_cycles,
    )
    from rigidimeter.analysis.estimation.signals import Signals

__all__ = [
    "METHODS",
    "Cycles",
    "Method",
    "Signals",
    "aligned",
    "amplitude_of_signals",
    "band_hz",
    "choose_method",
    "epoch_signals",
    "estimate_delays",
    "find_motion",
    "fit_epoch",
    "fit_epochs",
    "fit_inertia_damping_stiffness",
    "method_named",
    "method_names",
    "no_such_method",
    "score_epoch",
    "scoring_cycles",
]

__getattr__ = lazy_names(
    __name__,
    {
        "alignment": ("aligned", "estimate_delays"),
        "amplitude": ("amplitude_of_signals",),
        "bandlimited": ("band_hz",),
        "least_squares": ("fit_inertia_damping_stiffness",),
        "method_record": ("Method",),
        "methods": (
            "METHODS",
            "choose_method",
            "epoch_signals",
            "fit_epoch",
            "fit_epochs",
            "method_named",
            "method_names",
            "no_such_method",
        ),
        "scores": (
            "Cycles",
            "find_motion",
            "score_epoch",
            "scoring_cycles",
        ),
        "signals": ("Signals",),
    },
)
