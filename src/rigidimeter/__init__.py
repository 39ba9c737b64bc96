"""Measure joint rigidity with a perturbed, admittance-controlled robot.

From arrays, one estimate:

    import rigidimeter as rm
    fit = rm.identify(torque_nm=torque, angle_rad=angle, perturbation_nm=perturbation, rate_hz=1000)
    fit.stiffness_nm_rad, fit.stiffness_nm_rad_se

From files, everything that the command line does:

    recording = rm.read("elbow.csv")  # or rm.data("elbow"), an example
    estimates = rm.estimate(recording)
    rm.report(estimates, "report")

Each name is imported when it is first used, so that `import rigidimeter` costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rigidimeter.core.version import __version__

if TYPE_CHECKING:
    from rigidimeter.analysis.batch import batch
    from rigidimeter.analysis.figures import plot
    from rigidimeter.analysis.reading import data, identify, read
    from rigidimeter.analysis.recording import estimate, fit_terms
    from rigidimeter.analysis.report import report
    from rigidimeter.analysis.study import compare
    from rigidimeter.planning import design
    from rigidimeter.virtual import simulate

__all__ = [
    "__version__",
    "batch",
    "compare",
    "data",
    "design",
    "estimate",
    "fit_terms",
    "identify",
    "plot",
    "read",
    "report",
    "simulate",
]

_ROOMS = {
    "identify": "rigidimeter.analysis.reading",
    "read": "rigidimeter.analysis.reading",
    "data": "rigidimeter.analysis.reading",
    "estimate": "rigidimeter.analysis.recording",
    "compare": "rigidimeter.analysis.study",
    "fit_terms": "rigidimeter.analysis.recording",
    "simulate": "rigidimeter.virtual",
    "design": "rigidimeter.planning",
    "plot": "rigidimeter.analysis.figures",
    "report": "rigidimeter.analysis.report",
    "batch": "rigidimeter.analysis.batch",
}


def __getattr__(name: str) -> Any:
    if name not in _ROOMS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = function = _for_python(getattr(import_module(_ROOMS[name]), name))
    return function


def _for_python(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with messages that name arguments, not options of the command line."""
    from dataclasses import replace

    from rigidimeter.core.errors import UserError, arguments_named

    @wraps(function)
    def called(*values: Any, **named: Any) -> Any:
        try:
            found = function(*values, **named)
        except UserError as error:
            raise UserError(*map(arguments_named, error.lines)) from error.__cause__
        notices = getattr(found, "notices", ())
        told = tuple(replace(one, text=arguments_named(one.text)) for one in notices)
        return replace(found, notices=told) if told else found

    return called


def __dir__() -> list[str]:
    return sorted({*globals(), *_ROOMS})
