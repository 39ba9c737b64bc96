"""Simulated epochs of the joint of Sec. 3.4: what sensor noise and voluntary torque do to J, B, K.

White noise of the torque gives standard errors in a ratio that the motion sets and the size of the
noise does not: the Cramér–Rao bound (Sec. 3.4).

A subject's push moves the arm through the controller, so the motion is correlated with the push
that is also in the torque, and least squares drifts toward −(J_c, B_c, 0). The known perturbation
as an instrument does not (Sec. 1).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigidimeter.analysis import estimation
from rigidimeter.core.records import Fit
from rigidimeter.core.settings import Settings, SubjectSettings, parse_settings
from rigidimeter.core.words import number
from rigidimeter.model import Array
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import Bound, Claim, bounded, near, within_percent
from rigidimeter.paper.context import Context
from rigidimeter.planning import prbs_nm, predicted_precision
from rigidimeter.virtual import PAPER_RATES
from rigidimeter.virtual.batch import simulate_epochs

Triple = tuple[float, float, float]

TRUTH = np.array(printed.SEC_34.parameters)

_SIGMAS = 4.0
"""Standard errors that a mean may be off; chance exceeds it once in 16,000."""

SAME_RATIO_PERCENT = 50.0
"""How far the ratio of two printed SDs may be from the ratio that white noise gives."""

FAR_BELOW = 0.1
"""Noise below this share of the sensor's resolution is none that it could show."""

VOLUNTARY_SD_NM = 0.2

POOLED_PERCENT = 5.0
"""What counts as unbiased for ten epochs together by the perturbation as instrument: three times
the scatter of B from seed to seed, 1.7 %."""


def errors_percent(values: ArrayLike) -> Triple:
    """Return how far J, B and K are from those of Sec. 3.4, in percent."""
    J, B, K = 100.0 * (np.asarray(values) / TRUTH - 1.0)
    return float(J), float(B), float(K)


def signed(value: float, decimals: int) -> str:
    """Return a number with its sign, never as a negative zero."""
    return f"{round(value, decimals) + 0.0:+.{decimals}f}".replace("-", "−")


def _fitted(fit: Fit) -> Triple:
    return fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad


def _unbiased(errors: Triple, percent: float) -> tuple[Bound, ...]:
    return tuple(
        Bound(f"Error of {name}", "%", 0.0, error, -percent, percent)
        for name, error in zip("JBK", errors, strict=True)
    )


class NoiseRuns(NamedTuple):
    """What sensor noise alone does, in the units of J, B and K; arrays of shape (3,).

    `mean` and `sd` are of the errors by instrumental variables, `as_printed` is the mean error by
    the paper's method, `bound` is the Cramér–Rao bound of `sd`. `noise_sd_nm` and `resolution_nm`
    are those of a torque sample, at `rate_hz`.
    """

    mean: Array
    sd: Array
    as_printed: Array
    bound: Array
    noise_sd_nm: float
    resolution_nm: float
    rate_hz: float


def noise_runs(context: Context) -> NoiseRuns:
    """Return the simulations of Sec. 3.4: closed loop, white sensor noise, one joint."""
    return context.once(_noise_runs)


def _noise_runs(context: Context) -> NoiseRuns:
    runs = context.runs
    settings = parse_settings({"seed": context.seed, "rig": dict(PAPER_RATES)}, source="Sec. 3.4")
    batch = simulate_epochs(settings, runs, joints=[printed.SEC_34] * runs, conditions="OFF")
    epochs = [batch.epoch(i) for i in range(runs)]
    errors, as_printed = (
        np.array([_fitted(fit) for fit in estimation.estimate(epochs, settings, method).fits])
        - TRUTH
        for method in ("iv", "published")
    )
    perturbation = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    precision = predicted_precision(perturbation, settings, settings.subject["OFF"])
    sensor = settings.rig.torque
    return NoiseRuns(
        errors.mean(axis=0),
        errors.std(axis=0, ddof=1),
        as_printed.mean(axis=0),
        np.array(precision.bound.free),
        sensor.noise_sd_nm,
        sensor.resolution_nm,
        sensor.rate_hz,
    )


def mean_errors(context: Context) -> Claim:
    """Compare the mean errors of the paper's method with the printed ones."""
    found = noise_runs(context)
    percent = errors_percent(TRUTH + found.as_printed)
    allowed = _SIGMAS / math.sqrt(printed.SEC_34_RUNS)  # times a printed SD
    return Claim(
        ours=f"{context.runs} runs by the method as printed: {_numbers(found.as_printed)}, that is "
        f"{', '.join(signed(p, 0) for p in percent)} % of J, B, K",
        reading=f"Closed loop at the paper's rates, sensor noise {found.noise_sd_nm:g} N·m. The "
        f"mean of {printed.SEC_34_RUNS} runs may be off by {_SIGMAS:g} of its printed standard "
        "errors.",
        checks=tuple(
            near(f"Mean error of {name}", unit, paper, ours, allowed * sd)
            for name, unit, paper, ours, sd in zip(
                "JBK",
                ("kg·m²", "N·m·s/rad", "N·m/rad"),
                printed.SEC_34_MEAN,
                found.as_printed.tolist(),
                printed.SEC_34_SD,
                strict=True,
            )
        ),
    )


def mean_errors_by_instruments(context: Context) -> Claim:
    """Compare the mean errors by instrumental variables with their standard errors."""
    found = noise_runs(context)
    percent = errors_percent(TRUTH + found.mean)
    sigmas = found.mean / (found.sd / np.sqrt(context.runs))
    return Claim(
        ours=f"{context.runs} runs: {_numbers(found.mean)}, that is "
        f"{', '.join(signed(p, 3) for p in percent)} % of J, B, K, or "
        f"{', '.join(signed(s, 1) for s in sigmas)} standard errors of the mean",
        checks=tuple(
            Bound(f"Mean error of {name}", "standard errors", 0.0, float(s), -_SIGMAS, _SIGMAS)
            for name, s in zip("JBK", sigmas, strict=True)
        ),
    )


def spread_of_errors(context: Context) -> Claim:
    """Compare the standard deviations with the Cramér–Rao bound."""
    found = noise_runs(context)
    ratio = np.array(printed.SEC_34_SD) / printed.SEC_34_SD[2]
    wanted = found.bound / found.bound[2]
    efficiency = ", ".join(f"{v:.2f}" for v in found.sd / found.bound)
    return Claim(
        ours=f"{_numbers(found.sd)} ({context.runs} runs), "
        f"{_numbers(found.sd / found.sd[2], ' : ')}; Cramér–Rao {_numbers(wanted, ' : ')}; "
        f"ours over the bound {efficiency}",
        checks=tuple(
            within_percent(
                f"SD({name})/SD(K)", "", float(ratio[i]), float(wanted[i]), SAME_RATIO_PERCENT
            )
            for i, name in enumerate("JB")
        ),
    )


def implied_noise(context: Context) -> Claim:
    """Compare the noise that the printed SD of K would need with the sensor's."""
    found = noise_runs(context)
    implied_nm = found.noise_sd_nm * printed.SEC_34_SD[2] / float(found.bound[2])
    return Claim(
        ours=f"the printed SD of K needs a noise of {number(implied_nm, 2)} N·m at "
        f"{found.rate_hz:g} samples/s",
        reading=f"A resolution of {found.resolution_nm:g} N·m, the finest of such a transducer; "
        "the paper gives none.",
        checks=(
            bounded("Implied noise", "N·m", implied_nm, low=FAR_BELOW * found.resolution_nm),
        ),
        differs=f"That is 1/{found.resolution_nm / implied_nm:.0f} of the sensor's resolution and "
        f"1/{found.noise_sd_nm / implied_nm:.0f} of a noise of {found.noise_sd_nm:g} N·m, which "
        "such a sensor has.",
    )  # fmt: skip


def _numbers(values: ArrayLike, between: str = ", ") -> str:
    return between.join(number(float(value), 2) for value in np.asarray(values))


def voluntary_errors_percent(context: Context) -> Mapping[str, Triple]:
    """Return the errors of J, B and K under voluntary torque, by method, epochs pooled, in %.

    ``expected`` is what the loop predicts for least squares, without any simulation.
    """
    return context.once(_voluntary)


def _voluntary(context: Context) -> Mapping[str, Triple]:
    J, B, K = printed.SEC_34.parameters
    subject = SubjectSettings(
        inertia_kg_m2=J,
        damping_nm_s_rad=B,
        stiffness_nm_rad=K,
        voluntary_sd_nm=VOLUNTARY_SD_NM,
    )
    settings = Settings(seed=context.seed, subject={"OFF": subject})
    perturbation = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    bias = predicted_precision(perturbation, settings, subject).least_squares_bias
    batch = simulate_epochs(settings, context.pooled_epochs)
    epochs = [batch.epoch(i) for i in range(len(batch))]
    found = {"expected": errors_percent(TRUTH + np.array(bias))}
    # As the paper fits them: without weights.
    ordinary = [
        estimation.fit_inertia_damping_stiffness(
            estimation.epoch_signals(epoch, settings, "bandlimited")
        )
        for epoch in epochs
    ]
    found["least squares"] = errors_percent(np.mean([fit.value for fit in ordinary], axis=0))
    pooled = estimation.estimate(epochs, settings, "iv").pooled[0]
    found["iv"] = errors_percent(_fitted(pooled))
    return found


def voluntary_least_squares(context: Context) -> Claim:
    """Compare least squares under voluntary torque with the joint."""
    found = voluntary_errors_percent(context)
    J, B, K = found["least squares"]
    expected = ", ".join(f"{signed(error, 0)} %" for error in found["expected"])
    return Claim(
        ours=f"{context.pooled_epochs} epochs with {VOLUNTARY_SD_NM:g} N·m (SD, 0.3–4 Hz) of "
        f"voluntary torque, least squares: J {signed(J, 0)} %, B {signed(B, 0)} %, "
        f"K {signed(K, 0)} % (expected of this loop: {expected})",
        checks=_unbiased((J, B, K), POOLED_PERCENT),
    )


def voluntary_instruments(context: Context) -> Claim:
    """Compare instrumental variables under voluntary torque with the joint."""
    J, B, K = voluntary_errors_percent(context)["iv"]
    return Claim(
        ours="the same epochs by instrumental variables from the perturbation: "
        f"J {signed(J, 1)} %, B {signed(B, 1)} %, K {signed(K, 1)} %",
        checks=_unbiased((J, B, K), POOLED_PERCENT),
    )
