"""One epoch in, one fit out: the methods by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from rigidimeter.estimation.bandlimited import bandlimited_signals
from rigidimeter.estimation.leastsquares import fit_inertia_damping_stiffness
from rigidimeter.estimation.published import published_signals
from rigidimeter.estimation.screening import after_fit, before_fit, unusable
from rigidimeter.estimation.signals import Signals
from rigidimeter.records import Epoch, Fit
from rigidimeter.settings import EstimationSettings

__all__ = ["METHODS", "epoch_signals", "fit_epoch"]

METHODS: Mapping[str, Callable[[Epoch, EstimationSettings], Signals]] = {
    "bandlimited": bandlimited_signals,
    "published": published_signals,
}
"""How each method prepares the signals of an epoch; the default comes first."""


def epoch_signals(epoch: Epoch, method: str, settings: EstimationSettings) -> Signals:
    """Return the signals that `method` fits.

    Raises
    ------
    ValueError
        If the epoch cannot be fitted; the text says why.
    """
    obstacle = before_fit(epoch, settings)
    if obstacle:
        raise ValueError(obstacle)
    return METHODS[method](epoch, settings)


def fit_epoch(
    epoch: Epoch,
    method: str,
    settings: EstimationSettings,
    inertia_kg_m2: float | None = None,
) -> Fit:
    """Fit J, B and K to an epoch, or B and K when the inertia is given.

    An epoch that cannot be fitted gives a `Fit` whose outcome is `failed`, with the reason.
    """
    try:
        signals = epoch_signals(epoch, method, settings)
        solution = fit_inertia_damping_stiffness(signals, inertia_kg_m2)
    except ValueError as error:
        return Fit(
            source=epoch.source,
            epoch=epoch.label,
            condition=epoch.condition,
            method=method,
            outcome=unusable(epoch, str(error)),
        )
    (J, B, K), (J_se, B_se, K_se) = solution.parameters, solution.standard_errors
    return Fit(
        source=epoch.source,
        epoch=epoch.label,
        condition=epoch.condition,
        method=method,
        outcome=after_fit(epoch, solution.r_squared, solution.condition_number),
        inertia_kg_m2=J,
        inertia_kg_m2_se=J_se,
        damping_nm_s_rad=B,
        damping_nm_s_rad_se=B_se,
        stiffness_nm_rad=K,
        stiffness_nm_rad_se=K_se,
        r_squared=solution.r_squared,
        vaf_percent=solution.vaf_percent,
        condition_number=solution.condition_number,
        residual_sd_nm=solution.residual_sd_nm,
        n_samples=solution.n_samples,
        band_hz=signals.band_hz,
    )
