"""Whether the fit explains the torque, and whether a joint can have these numbers.

A residual that is white within the band carries nothing more to be explained, and textbook standard
errors hold for it. One that still follows the perturbation says that the model lacks something: a
delay between the channels, a reflex, a joint that is not linear.
"""

from __future__ import annotations

import math

import numpy as np
import scipy

from rigidimeter.analysis.estimation.bandlimited import zero_phase_band
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    HARMFUL,
    Case,
    Check,
    Harmless,
    Look,
    at_least,
    at_most,
    push_effect,
    push_harmless,
)
from rigidimeter.analysis.estimation.diagnostics.excitation_checks import perturbation_nm
from rigidimeter.analysis.estimation.power_lines import lines_inside, power_lines
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.terms.explained import explained
from rigidimeter.core.records import PARAMETERS, Epoch
from rigidimeter.core.settings import DiagnosticsSettings
from rigidimeter.core.units import rad_from_deg

LINES_TOGETHER = 8
LONGEST_LAG_S = 1.0


def residual_whiteness(residual_nm: Array, signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return the spectral flatness of the residual within the band: 1 for white.

    The geometric over the arithmetic mean of the power, lines taken eight together; their mean
    logarithm is that of white noise less ln 8 − ψ(8), which is made up for.
    """
    frequency, power = power_lines(residual_nm, signals.rate_hz)
    power = power[lines_inside(frequency, signals.band_hz)]
    groups = max(power.size // LINES_TOGETHER, 1)
    means = power[: groups * LINES_TOGETHER].reshape(groups, -1).mean(axis=1)
    value, least = math.nan, settings.min_residual_flatness
    if np.all(means > 0):
        made_up = math.log(LINES_TOGETHER) - float(scipy.special.digamma(LINES_TOGETHER))
        value = min(float(np.exp(np.mean(np.log(means)) + made_up) / np.mean(means)), 1.0)
    return at_least(value, least)


def residual_perturbation(
    epoch: Epoch, residual_nm: Array, signals: Signals, settings: DiagnosticsSettings
) -> Look:
    """Return how much of the torque follows the perturbation and is yet not explained.

    The largest correlation of residual and perturbation, at any lag up to 1 s either way, times the
    residual's share of the torque: in % of the torque's standard deviation. A correlation that two
    independent signals of these spectra reach in one of 20 epochs is none.
    """
    cause = perturbation_nm(epoch.channels["perturbation_nm"], signals.time_s)
    if signals.band_hz[0] > 0:
        cause = zero_phase_band(cause, signals.rate_hz, signals.band_hz)
    cause, residual = cause - cause.mean(), residual_nm - residual_nm.mean()
    size = float(np.linalg.norm(cause) * np.linalg.norm(residual))
    lag = min(round(LONGEST_LAG_S * signals.rate_hz), residual.size - 1)
    # As many zeros as lags, so that no end meets the other.
    length = scipy.fft.next_fast_len(residual.size + lag, real=True)
    both = scipy.fft.rfft(residual, length) * scipy.fft.rfft(cause, length).conj()
    together = scipy.fft.irfft(both, length) / (size or math.inf)
    near = together[np.arange(-lag, lag + 1)]
    at = int(np.argmax(np.abs(near)))
    delay_s = (at - lag) / signals.rate_hz
    r = float(abs(near[at]))
    chance = _chance_correlation(residual, cause, signals.rate_hz, lag)
    sd = float(np.std(signals.torque_nm))
    value = 100.0 * r * float(np.std(residual)) / sd if sd > 0 else math.nan
    most = settings.max_residual_perturbation_percent
    facts = {"correlation": r, "lag_s": delay_s, "chance": chance}
    return Look(value, most, not (value <= most or r <= chance), facts)


def _chance_correlation(a: Array, b: Array, rate_hz: float, lag: int) -> float:
    """Return what the largest of the correlations up to a lag stays below by chance, 19 in 20.

    Independent signals correlate with variance Σ P_a P_b / (Σ P_a Σ P_b) over all lines (Bartlett
    1935). As the lag runs, a Gaussian correlation of rms frequency ν passes ±u standard deviations
    2 ν T exp(−u²/2) times on average (Rice 1944), which is set to 1/20.
    """
    n = scipy.fft.prev_fast_len(a.size)  # a transform of any number may take many times as long
    power_a, power_b = np.abs(scipy.fft.rfft(a[:n])) ** 2, np.abs(scipy.fft.rfft(b[:n])) ** 2
    power = power_a * power_b
    total = float(np.sum(power_a) * np.sum(power_b))
    if total == 0.0:
        return 0.0
    # One-sided sums hold half of each: ½ remains.
    deviation = math.sqrt(0.5 * float(np.sum(power)) / total)
    frequency = scipy.fft.rfftfreq(n, 1.0 / rate_hz)
    rms_hz = math.sqrt(float(np.sum(frequency**2 * power)) / float(np.sum(power)))
    crossings = max(2.0 * rms_hz * 2.0 * lag / rate_hz, 0.1)
    return deviation * math.sqrt(2.0 * math.log(crossings / 0.05))


def held_out_vaf(signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return how much of the second half's torque the parameters of the first half explain."""
    half, torque = signals.time_s.size // 2, signals.torque_nm
    rows = np.column_stack([signals.motion, torque])[:half]
    upper = np.asarray(np.linalg.qr(rows, mode="r"))
    left = torque[half:] - signals.motion[half:] @ explained(upper[:, :-1], upper[:, -1]).values
    variance, least = float(np.var(torque[half:])), settings.min_held_out_vaf_percent
    value = 100.0 * (1.0 - float(np.var(left)) / variance) if variance > 0 else math.nan
    return at_least(value, least)


def r_squared(value: float, settings: DiagnosticsSettings) -> Look:
    """Return the share of the torque that J, B and K explain."""
    return at_least(value, settings.min_r_squared)


def negative_parameters(parameters: Array, high: Array | None = None) -> Look:
    """Return how many of J, B and K are not above zero (none may be).

    `high` are the upper ends of their intervals: a sign that noise may have made says nothing.
    """
    wrong = [name for name, value in zip("JBK", parameters, strict=True) if not value > 0]
    variant = ""
    if len(wrong) == len(parameters):
        variant = "noise" if high is not None and np.any(np.asarray(high) > 0) else "reaction"
    facts = {"names": " and ".join(wrong)}
    reaction = variant == "reaction"
    return Look(float(len(wrong)), 0.0, bool(wrong), facts, variant, excludes=reaction)


def implausible_parameters(parameters: Array, settings: DiagnosticsSettings) -> Look:
    """Return by what factor the worst of J, B and K is outside its range; at most 1 is inside.

    Only sizes are looked at; signs are another check's business.
    """
    J = abs(parameters[0])
    most = (
        settings.max_inertia_kg_m2,
        settings.max_damping_nm_s_rad,
        settings.max_stiffness_nm_rad,
    )
    factors = {(i, "large"): abs(parameters[i]) / most[i] for i in range(3)}
    factors[0, "small"] = settings.min_inertia_kg_m2 / J if J else math.inf
    worst, side = max(factors, key=lambda one: factors[one])
    about, size = PARAMETERS[worst], float(parameters[worst])
    return at_most(
        float(factors[worst, side]),
        1.0,
        symbol=about.symbol,
        size=size,
        size_unit=about.unit,
        side=side,
    )


def gravity(
    angle_rad: Array, stiffness_nm_rad: float, settings: DiagnosticsSettings
) -> Look | None:
    """Return K without the slope of the limb's weight; None where that is not in the settings.

    A limb at the angle θ from hanging straight down takes the torque m g l sin θ, whose slope
    m g l cos θ is in K.
    """
    if settings.gravity_nm == 0.0:
        return None
    hanging_rad = rad_from_deg(settings.gravity_angle_deg)
    slope = settings.gravity_nm * float(np.mean(np.cos(hanging_rad + angle_rad)))
    facts = {"stiffness": stiffness_nm_rad, "slope": slope}
    return Look(stiffness_nm_rad - slope, math.nan, True, facts)


def _by_noise(case: Case, look: Look) -> Harmless:
    """Return why torque beyond the model does not matter to a method that weights it away."""
    weighted = case.method is not None and case.method.by_noise
    return push_harmless(case, look) if weighted else HARMFUL


def _by_chance(case: Case, look: Look) -> Harmless:
    """Return why a single epoch is no proof, unless torque of the subject biases the estimate.

    What the perturbation causes beyond J, B and K biases every method, so nothing is claimed of
    them.
    """
    return HARMFUL if push_harmless(case, look) == HARMFUL else ("chance", {})


RESIDUAL_CHECKS = (
    Check(
        "residual_whiteness",
        (),
        lambda c: residual_whiteness(-c.voluntary_nm, c.signals, c.settings),
        harmless=push_harmless,
        effect=push_effect,
    ),
    Check(
        "residual_perturbation",
        ("perturbation_nm",),
        lambda c: residual_perturbation(c.epoch, -c.voluntary_nm, c.signals, c.settings),
        harmless=_by_chance,
    ),
    Check(
        "held_out_vaf",
        (),
        lambda c: held_out_vaf(c.signals, c.settings),
        of_fit=False,
        harmless=push_harmless,
        effect=push_effect,
    ),
)

PARAMETER_CHECKS = (
    Check(
        "gravity",
        ("angle_rad",),
        lambda c: gravity(c.epoch.channels["angle_rad"].values, c.parameters[2], c.settings),
    ),
    Check(
        "r_squared",
        (),
        lambda c: r_squared(c.fit.r_squared, c.settings) if c.fit is not None else None,
        harmless=_by_noise,
        effect=push_effect,
    ),
    Check(
        "negative_parameters",
        (),
        lambda c: negative_parameters(c.parameters, None if c.fit is None else c.fit.high),
        may_exclude=True,
    ),
    Check("implausible_parameters", (), lambda c: implausible_parameters(c.parameters, c.settings)),
)
