"""What the design predicts against the product's own estimates on the virtual rig."""

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from rigidimeter.analysis.estimation import (
    epoch_signals,
    estimate_recorded,
    fit_inertia_damping_stiffness,
    prepare,
)
from rigidimeter.analysis.statistics import day_difference
from rigidimeter.core.records import Analysis, Epoch, Fit
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import (
    PARAMETER_NAMES,
    PredictedPrecision,
    Scatter,
    WantedDifference,
    detections,
    paired_power,
    prbs_nm,
    predicted_precision,
)
from rigidimeter.virtual import PAPER_RATES
from rigidimeter.virtual.batch import simulate_chunks

SESSION = 25
"""Epochs that are fitted together."""


def plan(voluntary_sd_nm: float, rig: dict) -> tuple[Settings, PredictedPrecision]:
    """Return settings whose only subject has this voluntary torque, and what is predicted."""
    subject = {"OFF": {"voluntary_sd_nm": voluntary_sd_nm}}
    settings = parse_settings(
        {"subject": subject, "rig": rig, "protocol": {"blocks": [{"epochs": 1}]}}
    )
    torque_nm = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    return settings, predicted_precision(torque_nm, settings, settings.subject["OFF"])


def sessions(settings: Settings, epochs: int, seed: int) -> Iterator[list[Epoch]]:
    for batch in simulate_chunks(settings, epochs, chunk=SESSION, seed=seed):
        yield [batch.epoch(i) for i in range(len(batch))]


def analysed(epochs: list[Epoch], settings: Settings) -> Analysis:
    recorded = prepare(epochs, settings, clocks=False)
    return estimate_recorded(recorded, "iv", fits_alone=True)


def table(fits: Sequence[Fit], ending: str = "") -> np.ndarray:
    return np.array([[getattr(fit, name + ending) for name in PARAMETER_NAMES] for fit in fits])


@pytest.mark.parametrize(("voluntary_sd_nm", "rig"), [(0.0, {}), (0.2, {}), (0.2, PAPER_RATES)])
def test_the_estimation_lays_out_the_same_lines_and_finds_the_same_bound(
    voluntary_sd_nm: float, rig: dict
) -> None:
    """From the residuals of 25 epochs. K rests on a few lines beside a steep edge, whose power so
    many epochs tell to 20 % or so."""
    settings, found = plan(voluntary_sd_nm, rig)
    (epochs,) = sessions(settings, SESSION, seed=5)
    fits = analysed(epochs, settings).fits
    assert fits[0].band_hz == pytest.approx(found.iv_band_hz, rel=1e-9)
    J, B, K = np.median(table(fits, "_bound"), axis=0) / found.iv.free
    assert pytest.approx(1.0, abs=0.1) == J
    assert pytest.approx(1.0, abs=0.1) == B
    assert pytest.approx(1.0, abs=0.25) == K


@pytest.mark.slow
@pytest.mark.parametrize("rig", [{}, PAPER_RATES], ids=["1 kHz", "the paper's rates"])
@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.2, 0.5])
def test_iv_scatters_as_predicted(voluntary_sd_nm: float, rig: dict) -> None:
    """500 epochs: the SD of their estimates is known to 3 %."""
    settings, found = plan(voluntary_sd_nm, rig)
    free, fixed = [], []
    for epochs in sessions(settings, 500, seed=19):
        analysis = analysed(epochs, settings)
        free += analysis.fits
        fixed += analysis.fixed_inertia
    assert all(fit.outcome.included for fit in free)
    ratio = np.std(table(free), axis=0, ddof=1) / found.iv.free
    fixed_ratio = np.std(table(fixed)[:, 1:], axis=0, ddof=1) / found.iv.fixed_inertia
    print(f"\nscatter / predicted {np.round(ratio, 3)}, with J held {np.round(fixed_ratio, 3)}")
    np.testing.assert_allclose(ratio, 1.0, atol=0.1)
    np.testing.assert_allclose(fixed_ratio, 1.0, atol=0.1)


@pytest.mark.slow
def test_least_squares_is_off_as_predicted() -> None:
    settings, found = plan(0.2, {})
    fits = [
        fit_inertia_damping_stiffness(epoch_signals(epoch, settings, "bandlimited"))
        for epochs in sessions(settings, 100, seed=20)
        for epoch in epochs
    ]
    assert fits[0].band_hz == found.least_squares_band_hz
    off = np.mean(table(fits), axis=0) / found.values - 1.0
    predicted = np.array(found.least_squares_bias) / found.values
    print(f"\nleast squares off by {np.round(off, 3)}, predicted {np.round(predicted, 3)}")
    np.testing.assert_allclose(off, predicted, atol=0.03)


@pytest.mark.slow
def test_studies_see_the_difference_as_often_as_predicted() -> None:
    """Days with both conditions, fits of J, B and K in each epoch, and the test of `compare`.

    The joint varies between epochs; nothing varies between days."""
    studies, n = 250, 3
    varied = {"voluntary_sd_nm": 0.2, "damping_cv_percent": 15.0}
    settings = parse_settings(
        {
            "subject": {"OFF": varied, "ON": {**varied, "damping_nm_s_rad": 0.8 * 0.1368}},
            "protocol": {"blocks": [{"epochs": n}, {"epochs": n, "condition": "ON"}]},
        }
    )
    torque_nm = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    of_epochs = {"damping": Scatter(15.0, 0.0, 0.0, "drawn")}
    wanted = WantedDifference.parse("damping=20%")
    (found,) = detections(settings, torque_nm, [wanted], scatter=of_epochs)
    assert found.planned is not None
    assert found.planned.epochs == (n, n)
    days = found.planned.days
    assert days is not None
    predicted = paired_power(found.difference, found.planned.day_sd, days)
    significant = 0
    labels = [f"{day}" for day in range(days) for _ in range(n)]
    for batch in simulate_chunks(
        settings,
        studies * 2 * n * days,
        chunk=2 * n * days,
        conditions=[*["OFF"] * (n * days), *["ON"] * (n * days)] * studies,
        seed=21,
    ):
        epochs = [batch.epoch(i) for i in range(len(batch))]
        B = [fit.damping_nm_s_rad for fit in analysed(epochs, settings).fits]
        significant += day_difference(B[: n * days], B[n * days :], labels, labels).p < 0.05
    power = significant / studies
    print(f"\n{days} days: power {power:.3f}, predicted {predicted:.3f}")
    monte_carlo = np.sqrt(power * (1 - power) / studies)
    assert abs(power - predicted) < 0.03 + 2 * monte_carlo
