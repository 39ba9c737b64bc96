"""Epochs in, fits out: the methods by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from rigidimeter.estimation.bandlimited import bandlimited_signals
from rigidimeter.estimation.closedloop import CLOSED_LOOP, closed_loop_obstacle, fit_closed_loop
from rigidimeter.estimation.least_squares import fit_inertia_damping_stiffness
from rigidimeter.estimation.published_method import published_signals
from rigidimeter.estimation.screening import after_fit, before_fit, unusable
from rigidimeter.estimation.signals import Signals
from rigidimeter.records import Epoch, Fit
from rigidimeter.settings import EstimationSettings, Settings

__all__ = ["METHODS", "choose_method", "epoch_signals", "fit_epoch", "fit_epochs"]

_LEAST_SQUARES: Mapping[str, Callable[[Epoch, EstimationSettings], Signals]] = {
    "bandlimited": bandlimited_signals,
    "published": published_signals,
}
"""How each method of least squares prepares the signals of an epoch."""

METHODS: tuple[str, ...] = ("auto", *_LEAST_SQUARES, *CLOSED_LOOP)
"""The methods by name; the default comes first."""


def choose_method(epochs: Sequence[Epoch]) -> tuple[str, str]:
    """Return the method that suits what was recorded, and why.

    With the perturbation, instrumental variables: they do not mind a subject who pushes. An epoch
    that lacks it then fails, unless most do. Without it nothing but least squares is left.
    """
    if not epochs:
        return "bandlimited", "there is no epoch to fit"
    obstacles = [obstacle for epoch in epochs if (obstacle := closed_loop_obstacle(epoch))]
    if 2 * len(obstacles) > len(epochs):
        return (
            "bandlimited",
            f"{obstacles[0]} (in {len(obstacles)} of {len(epochs)} epochs), so the motion itself "
            "has to stand as the instrument: a subject who pushes in a closed loop biases the "
            "estimate",
        )
    where = f" in {len(epochs) - len(obstacles)} of {len(epochs)} epochs" if obstacles else ""
    return (
        "iv",
        f"the perturbation was recorded{where}, so its own part of the motion can be the "
        "instrument: a subject who pushes does not bias the estimate",
    )


def epoch_signals(epoch: Epoch, method: str, settings: EstimationSettings) -> Signals:
    """Return the signals that `method` fits; those of ``bandlimited`` for methods of lines.

    Raises
    ------
    ValueError
        If the epoch cannot be fitted; the text says why.
    """
    obstacle = before_fit(epoch, settings)
    if obstacle:
        raise ValueError(obstacle)
    return _LEAST_SQUARES.get(method, bandlimited_signals)(epoch, settings)


def fit_epochs(
    epochs: Sequence[Epoch],
    method: str,
    settings: Settings,
    inertia_kg_m2: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[list[Fit], list[Fit]]:
    """Fit every epoch, and all epochs of a condition together.

    Parameters
    ----------
    epochs : sequence of Epoch
    method : str
        A name of `METHODS` other than ``auto``.
    settings : Settings
    inertia_kg_m2 : float, optional
        Hold J at this value (Eq. 7).
    progress : callable
        Called with the name of each epoch once it is done.

    Returns
    -------
    fits : list of Fit
        One for each epoch, in order.
    pooled : list of Fit
        One for each condition, and with several one for all, whose condition is empty.
    """
    if method in CLOSED_LOOP:
        return fit_closed_loop(epochs, method, settings, inertia_kg_m2, progress)
    fits = []
    kept: dict[str, list[tuple[Fit, Signals]]] = {}
    for epoch in epochs:
        fit, signals = _fit(epoch, method, settings.estimation, inertia_kg_m2)
        fits.append(fit)
        if signals is not None and fit.outcome.included:
            kept.setdefault(epoch.condition, []).append((fit, signals))
        progress(epoch.name)
    groups = list(kept.items())
    if len(groups) > 1:
        groups.append(("", [member for _, members in groups for member in members]))
    pooled = [
        _pooled(condition, members, settings.estimation, inertia_kg_m2)
        for condition, members in groups
    ]
    return fits, pooled


def fit_epoch(
    epoch: Epoch,
    method: str,
    settings: EstimationSettings,
    inertia_kg_m2: float | None = None,
) -> Fit:
    """Fit J, B and K to an epoch by least squares, or B and K when the inertia is given.

    An epoch that cannot be fitted gives a `Fit` whose outcome is `failed`, with the reason.
    """
    return _fit(epoch, method, settings, inertia_kg_m2)[0]


def _fit(
    epoch: Epoch, method: str, settings: EstimationSettings, inertia_kg_m2: float | None
) -> tuple[Fit, Signals | None]:
    try:
        signals = epoch_signals(epoch, method, settings)
        fit = fit_inertia_damping_stiffness(signals, inertia_kg_m2, settings)
    except ValueError as error:
        outcome = unusable(epoch, str(error))
        return Fit(epoch.source, epoch.label, epoch.condition, method, outcome), None
    outcome = after_fit(epoch, fit.r_squared, fit.condition_number)
    named = replace(
        fit,
        source=epoch.source,
        epoch=epoch.label,
        condition=epoch.condition,
        method=method,
        outcome=outcome,
    )
    return named, signals


def _pooled(
    condition: str,
    members: Sequence[tuple[Fit, Signals]],
    settings: EstimationSettings,
    inertia_kg_m2: float | None,
) -> Fit:
    """Return the least squares over all epochs of a condition, put one after the other."""
    fits, parts = zip(*members, strict=True)
    first = parts[0]
    together = replace(
        first,
        time_s=np.concatenate([part.time_s for part in parts]),
        torque_nm=np.concatenate([part.torque_nm for part in parts]),
        acceleration_rad_s2=np.concatenate([part.acceleration_rad_s2 for part in parts]),
        velocity_rad_s=np.concatenate([part.velocity_rad_s for part in parts]),
        angle_rad=np.concatenate([part.angle_rad for part in parts]),
    )
    return replace(
        fit_inertia_damping_stiffness(together, inertia_kg_m2, settings),
        source=", ".join(dict.fromkeys(member.source for member in fits)),
        epoch="pooled",
        condition=condition,
        method=fits[0].method,
    )
