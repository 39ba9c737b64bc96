"""The estimators by name. A new one is a module with its `Method` record and a line here."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence

from rigidimeter.analysis.estimation.bandlimited import bandlimited_signals
from rigidimeter.analysis.estimation.closedloop.line_methods import (
    BANDLIMITED,
    IV,
    SPECTRAL,
)
from rigidimeter.analysis.estimation.closedloop.observe import observe
from rigidimeter.analysis.estimation.closedloop.periodic_response import follows_perturbation
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import closed_loop_obstacle
from rigidimeter.analysis.estimation.method_record import Method
from rigidimeter.analysis.estimation.prepared import PreparedEpoch, prepare
from rigidimeter.analysis.estimation.published_method import PUBLISHED
from rigidimeter.analysis.estimation.screening import before_fit
from rigidimeter.analysis.estimation.signals import Signals
from rigidimeter.analysis.estimation.stretches import bridged
from rigidimeter.core.records import Epoch, Fit
from rigidimeter.core.settings import EstimationSettings, Settings

METHODS: list[Method] = [PUBLISHED, BANDLIMITED, IV, SPECTRAL]
"""Every estimator. Code from outside the package may append its own."""

MOST_TRIED = 5
"""From this many epochs it is known whether the motion follows the perturbation."""


def method_names() -> tuple[str, ...]:
    """Return what `--method` takes: ``auto``, the default, and the name of each estimator."""
    return ("auto", *(method.name for method in METHODS))


def no_such_method(name: str) -> str:
    """Return why `--method` cannot be `name`, and what it may be."""
    known = method_names()
    (near,) = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
    return f"there is no such method; the nearest is {near} (known: {', '.join(known)})"


def method_named(name: str) -> Method:
    """Return the estimator of that name.

    Raises
    ------
    ValueError
        If there is none, with the names of those there are; or if two have the name.
    """
    found = [method for method in METHODS if method.name == name]
    if not found:
        raise ValueError(no_such_method(name))
    if len(found) > 1:
        raise ValueError(f"two methods have the name {name}; rename the one that was added")
    return found[0]


def choose_method(epochs: Sequence[PreparedEpoch]) -> tuple[str, str]:
    """Return the method that suits what was recorded, and why.

    With a perturbation that the motion follows, instrumental variables, which a subject who pushes
    does not bias. An epoch that lacks it then fails, unless most do. Without it only least squares
    is possible.
    """
    if not epochs:
        return "bandlimited", "there is no epoch to fit"
    obstacles = [
        obstacle for prepared in epochs if (obstacle := closed_loop_obstacle(prepared.epoch))
    ]
    least_squares = (
        "so least squares weighted by noise is used: torque of the subject over all of the band, "
        "or a joint that is not J, B and K, biases it"
    )
    if 2 * len(obstacles) > len(epochs):
        found = f"{obstacles[0]} (in {len(obstacles)} of {len(epochs)} epochs)"
        return "bandlimited", f"{found}, {least_squares}"
    tried = [p for p in epochs if not p.obstacle and not closed_loop_obstacle(p.epoch)]
    unanswered = [p for p in tried[:MOST_TRIED] if not p.once(_answered)]
    if 2 * len(unanswered) > min(len(tried), MOST_TRIED):
        return "bandlimited", (
            f"the motion does not follow perturbation_nm (in {len(unanswered)} of "
            f"{min(len(tried), MOST_TRIED)} epochs that were tried; first epoch "
            f"{unanswered[0].epoch.label}), {least_squares}. Check which column holds the "
            "perturbation, and that it and the motion have one clock; --method iv uses it "
            "all the same"
        )
    where = f" in {len(epochs) - len(obstacles)} of {len(epochs)} epochs" if obstacles else ""
    return (
        "iv",
        f"the perturbation was recorded{where}, so the motion that it causes is the instrument: "
        "torque not from the robot does not bias the estimate",
    )


def _answered(prepared: PreparedEpoch) -> bool:
    try:
        return follows_perturbation(prepared.once(observe))
    except ValueError:
        return True  # the fit says why


def prepared_signals(prepared: PreparedEpoch, method: str) -> Signals:
    """Return the signals that a method fitted; those of ``bandlimited`` where it fits none.

    Raises
    ------
    ValueError
        If the epoch cannot be fitted; the text says why.
    """
    return prepared.signals(method_named(method).signals or bandlimited_signals)


def epoch_signals(epoch: Epoch, method: str, settings: EstimationSettings) -> Signals:
    """Return `prepared_signals` of an epoch alone, whose drive is not known.

    Raises
    ------
    ValueError
        If the epoch cannot be fitted; the text says why.
    """
    obstacle = before_fit(epoch, settings)
    if obstacle:
        raise ValueError(obstacle)
    return (method_named(method).signals or bandlimited_signals)(bridged(epoch), settings, None)


def fit_epochs(
    epochs: Iterable[Epoch],
    method: str,
    settings: Settings,
    inertia_kg_m2: float | None = None,
) -> tuple[list[Fit], list[Fit]]:
    """Fit every epoch, and all epochs of a condition together, by the method of that name.

    For epochs that are fitted once; `prepare` those that are fitted again. Parameters and values
    are those of `method_record.FitEpochs`.
    """
    return method_named(method).fit(prepare(epochs, settings), inertia_kg_m2, lambda _: None, True)


def fit_epoch(
    epoch: Epoch, method: str, settings: Settings, inertia_kg_m2: float | None = None
) -> Fit:
    """Fit J, B and K to one epoch, or B and K when the inertia is given.

    An epoch that cannot be fitted gives a `Fit` whose outcome is `failed`, with the reason.
    """
    (fit,), _ = fit_epochs([epoch], method, settings, inertia_kg_m2)
    return fit
