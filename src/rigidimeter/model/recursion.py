"""J, B and K while the epoch runs: one step for each sample, no array, no matrix inverse.

Torque, angle and velocity pass the same causal filter, a Butterworth high-pass of second and a
low-pass of fourth order, each section by its two states (state-variable form, trapezoidal). The
acceleration is the derivative of the filtered velocity, which the last section holds as a state, so
nothing is differenced. At f it reads tan(x)/x too high, x = π f / rate: 0.03 % at 10 Hz and 1 kHz.
The filters begin as if the first values had always been, which is so at rest; begun in the middle
of a motion, the estimate is off for as long as the lower edge remembers (some 3 s at 0.15 Hz).

Then least squares in which a sample of age t counts exp(−t / τ). Of the weighted regressors A only
the triangle R of A = Q R is kept, with z = Qᵀ M. A new sample is rotated in (Givens):

    [√λ R   √λ z]      [R   z]
    [  xᵀ     m ]  →   [0   ε]        R p = z,   λ = exp(−1 / (rate τ))

which is as exact as a batch solution and cannot lose its sign or its symmetry, as a covariance can.
Forgetting without learning would let R shrink to nothing (windup): while the velocity has next to
none of the power it had, the joint is at rest, and a sample neither counts nor lets others age.

It is least squares: a subject who pushes biases it as it does the batch fit.
"""

from __future__ import annotations

import math
from collections.abc import MutableSequence, Sequence
from typing import NamedTuple

from rigidimeter.core.settings import OnlineSettings

# Where things stand in the state.
_STARTED = 0
_FILTERS = 1  # torque, angle, velocity; three sections each; two states each
_R = 19  # R00 R01 R02 R11 R12 R22
_Z = 25  # z0 z1 z2
_RSS = 28  # weighted sum of squared residuals
_WEIGHT = 29  # sum of weights
_WEIGHT2 = 30  # sum of squared weights
_VALUES = 31  # J B K
_INNOVATION = 34
_GAIN = 35
_POWER = 36  # of the velocity, lately
_RESTING = 37
_BAND_TORQUE = 38
STATE_SIZE = 39
"""A state is this many numbers, zero at first."""

UNDETERMINED = 1e-9
"""With a diagonal of R below this part of its column, the motion so far cannot distinguish them."""


class OnlineDesign(NamedTuple):
    """What a step needs, computed beforehand.

    `high_*` and `low*_*` are the sections of high-pass and low-pass; `per_s` makes the derivative
    of a state of the last. `forgetting` is λ, `power_forgetting` that of the velocity's power.
    `independent` is how many independent values a sample of the band adds.
    """

    high_k: float
    high_1: float
    high_2: float
    high_3: float
    low1_1: float
    low1_2: float
    low1_3: float
    low2_1: float
    low2_2: float
    low2_3: float
    per_s: float
    forgetting: float
    root_forgetting: float
    power_forgetting: float
    rest_share: float
    rest_after: float
    independent: float


class OnlineEstimate(NamedTuple):
    """What is known now. Numbers are NaN, and errors infinite, before enough has been seen.

    Attributes
    ----------
    gain : float
        What part of the innovation, by which the last torque missed what the parameters before it
        foresaw, the fit took up, 0 to 1.
    residual_sd_nm : float
        Of the torque about the fit, weighted as the samples are.
    memory_s : float
        How much motion is remembered: the sum of the weights, at most τ.
    resting : bool
        Whether the last sample was passed over because the joint did not move.
    """

    inertia_kg_m2: float
    inertia_kg_m2_se: float
    damping_nm_s_rad: float
    damping_nm_s_rad_se: float
    stiffness_nm_rad: float
    stiffness_nm_rad_se: float
    gain: float
    residual_sd_nm: float
    memory_s: float
    resting: bool


def online_design(settings: OnlineSettings, rate_hz: float) -> OnlineDesign:
    """Return the coefficients of a step at a sampling rate.

    Raises
    ------
    ValueError
        If the band does not lie below half the rate.
    """
    if not settings.band_high_hz < rate_hz / 2:
        raise ValueError(
            f"band_high_hz = {settings.band_high_hz:g} Hz must stay below half the rate of "
            f"{rate_hz:g} Hz"
        )
    high, low = settings.band_low_hz, settings.band_high_hz
    # A Butterworth filter of fourth order is two sections with these dampings.
    k1, k2 = 2.0 * math.sin(math.pi / 8.0), 2.0 * math.cos(math.pi / 8.0)
    forgetting = math.exp(-1.0 / (rate_hz * settings.forgetting_s))
    return OnlineDesign(
        math.sqrt(2.0),
        *_section(high, math.sqrt(2.0), rate_hz),
        *_section(low, k1, rate_hz),
        *_section(low, k2, rate_hz),
        per_s=2.0 * rate_hz * math.tan(math.pi * low / rate_hz),
        forgetting=forgetting,
        root_forgetting=math.sqrt(forgetting),
        power_forgetting=math.exp(-1.0 / (rate_hz * settings.rest_window_s)),
        rest_share=settings.rest_share_percent / 100.0,
        rest_after=rate_hz * min(settings.rest_window_s, settings.forgetting_s / 2.0),
        independent=min(1.0, 2.0 * (low - high) / rate_hz),
    )


def _section(corner_hz: float, damping: float, rate_hz: float) -> tuple[float, float, float]:
    """Return the coefficients of a section with its corner where it is asked for (prewarped)."""
    g = math.tan(math.pi * corner_hz / rate_hz)
    first = 1.0 / (1.0 + g * (g + damping))
    return first, g * first, g * g * first


def online_step(
    design: OnlineDesign,
    state: MutableSequence[float],
    torque_nm: float,
    angle_rad: float,
    velocity_rad_s: float,
) -> float:
    """Take one sample; the state is changed in place.

    A sample that is not a number is passed over.

    Parameters
    ----------
    design : OnlineDesign
    state : list of float, length STATE_SIZE
        Zeros at first.
    torque_nm, angle_rad, velocity_rad_s : float
        As measured.

    Returns
    -------
    float
        The innovation in N·m; NaN before the parameters are determined.
    """
    high_k, high_1, high_2, high_3, low1_1, low1_2, low1_3 = design[:7]
    low2_1, low2_2, low2_3, per_s, forgetting, root = design[7:13]
    power_forgetting, rest_share, rest_after = design[13:16]
    if not math.isfinite(torque_nm + angle_rad + velocity_rad_s):
        return math.nan
    if state[_STARTED] == 0.0:
        # As if the first values had always been: an offset then makes no transient.
        state[_STARTED] = 1.0
        state[_FILTERS + 1] = torque_nm
        state[_FILTERS + 7] = angle_rad
        state[_FILTERS + 13] = velocity_rad_s
        state[_VALUES] = state[_VALUES + 1] = state[_VALUES + 2] = math.nan

    m = x2 = x1 = x0 = 0.0
    for signal in range(3):
        at = _FILTERS + 6 * signal
        value = torque_nm if signal == 0 else (angle_rad if signal == 1 else velocity_rad_s)
        one, two = state[at], state[at + 1]
        rest = value - two
        slope = high_1 * one + high_2 * rest
        level = two + high_2 * one + high_3 * rest
        state[at], state[at + 1] = 2.0 * slope - one, 2.0 * level - two
        value = value - high_k * slope - level
        one, two = state[at + 2], state[at + 3]
        rest = value - two
        slope = low1_1 * one + low1_2 * rest
        level = two + low1_2 * one + low1_3 * rest
        state[at + 2], state[at + 3] = 2.0 * slope - one, 2.0 * level - two
        one, two = state[at + 4], state[at + 5]
        rest = level - two
        slope = low2_1 * one + low2_2 * rest
        level = two + low2_2 * one + low2_3 * rest
        state[at + 4], state[at + 5] = 2.0 * slope - one, 2.0 * level - two
        if signal == 0:
            m = level
        elif signal == 1:
            x2 = level
        else:
            x1, x0 = level, per_s * slope

    J, B, K = state[_VALUES], state[_VALUES + 1], state[_VALUES + 2]
    innovation = m - J * x0 - B * x1 - K * x2
    state[_BAND_TORQUE], state[_INNOVATION] = m, innovation
    power = power_forgetting * state[_POWER] + (1.0 - power_forgetting) * x1 * x1
    state[_POWER] = power
    r01, r11, weight = state[_R + 1], state[_R + 3], state[_WEIGHT]
    usual = r01 * r01 + r11 * r11
    if weight > rest_after and power * weight < rest_share * usual:
        state[_RESTING] = 1.0
        state[_GAIN] = 0.0
        return innovation

    state[_RESTING] = 0.0
    r00, r01, r02 = root * state[_R], root * r01, root * state[_R + 2]
    r11, r12, r22 = root * r11, root * state[_R + 4], root * state[_R + 5]
    z0, z1, z2 = root * state[_Z], root * state[_Z + 1], root * state[_Z + 2]
    kept = 1.0
    length = math.sqrt(r00 * r00 + x0 * x0)
    if length > 0.0:
        c, s = r00 / length, x0 / length
        r00, r01, x1 = length, c * r01 + s * x1, c * x1 - s * r01
        r02, x2 = c * r02 + s * x2, c * x2 - s * r02
        z0, m = c * z0 + s * m, c * m - s * z0
        kept = c
    length = math.sqrt(r11 * r11 + x1 * x1)
    if length > 0.0:
        c, s = r11 / length, x1 / length
        r11, r12, x2 = length, c * r12 + s * x2, c * x2 - s * r12
        z1, m = c * z1 + s * m, c * m - s * z1
        kept *= c
    length = math.sqrt(r22 * r22 + x2 * x2)
    if length > 0.0:
        c, s = r22 / length, x2 / length
        r22 = length
        z2, m = c * z2 + s * m, c * m - s * z2
        kept *= c
    state[_R], state[_R + 1], state[_R + 2] = r00, r01, r02
    state[_R + 3], state[_R + 4], state[_R + 5] = r11, r12, r22
    state[_Z], state[_Z + 1], state[_Z + 2] = z0, z1, z2
    state[_RSS] = forgetting * state[_RSS] + m * m
    state[_WEIGHT] = forgetting * weight + 1.0
    state[_WEIGHT2] = forgetting * forgetting * state[_WEIGHT2] + 1.0
    state[_GAIN] = 1.0 - kept * kept
    if r00 > 0.0 and r11 > UNDETERMINED * abs(r01) and r22 > UNDETERMINED * (abs(r02) + abs(r12)):
        K = z2 / r22
        B = (z1 - r12 * K) / r11
        state[_VALUES] = (z0 - r01 * B - r02 * K) / r00
        state[_VALUES + 1] = B
        state[_VALUES + 2] = K
    return innovation


def online_reading(
    design: OnlineDesign, state: MutableSequence[float], rate_hz: float
) -> OnlineEstimate:
    """Return the parameters with their standard errors, for whoever looks.

    cov p = σ² (RᵀR)⁻¹ · Σw²/Σw / independent, with σ² the weighted mean square of the residual:
    the squares of the weights stand in the middle, and neighbours in a band are not independent.
    As in the batch fit, this holds for a residual that is white within the band.
    """
    J, B, K = (float(value) for value in state[_VALUES : _VALUES + 3])
    weight, weight2 = state[_WEIGHT], state[_WEIGHT2]
    sd = J_se = B_se = K_se = math.inf
    if weight2 > 0.0 and math.isfinite(J + B + K):
        independent = design.independent * weight * weight / weight2
        if independent > 3.0:
            variance = state[_RSS] / weight * independent / (independent - 3.0)
            sd = math.sqrt(variance)
            spread = math.sqrt(variance * weight2 / weight / design.independent)
            J_se, B_se, K_se = (spread * root for root in _root_inverse(state))
    else:
        J = B = K = math.nan
    return OnlineEstimate(
        J, J_se, B, B_se, K, K_se,
        gain=float(state[_GAIN]),
        residual_sd_nm=sd,
        memory_s=float(weight) / rate_hz,
        resting=state[_RESTING] > 0.0,
    )  # fmt: skip


def online_torque(state: Sequence[float]) -> tuple[float, float]:
    """Return the torque of the last sample in the band in N·m: as measured, and as modelled.

    The model is J θ″ + B θ′ + K θ with the parameters as they were before this sample.
    """
    measured_nm = state[_BAND_TORQUE]
    return measured_nm, measured_nm - state[_INNOVATION]


def _root_inverse(state: MutableSequence[float]) -> tuple[float, float, float]:
    """Return the roots of the diagonal of (RᵀR)⁻¹: the lengths of the rows of R⁻¹."""
    r00, r01, r02, r11, r12, r22 = (float(value) for value in state[_R : _R + 6])
    i01 = -r01 / (r00 * r11)
    i12 = -r12 / (r11 * r22)
    i02 = (r01 * r12 / r11 - r02) / (r00 * r22)
    return (
        math.sqrt(1.0 / r00**2 + i01**2 + i02**2),
        math.hypot(1.0 / r11, i12),
        1.0 / r22,
    )
