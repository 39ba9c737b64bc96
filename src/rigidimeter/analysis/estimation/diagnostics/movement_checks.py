"""Whether the subject moved by itself: by the torque the joint does not explain, and by EMG.

Once J, B and K are known, so is the subject's own torque (Eq. 5):

    M_sub = J θ'' + B θ' + K θ − M_meas

Least squares makes it as small as it can, so that part of a large M_sub hides in J, B and K: what
is seen here is the least of it.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from rigidimeter.analysis.estimation.bandlimited import zero_phase_band
from rigidimeter.analysis.estimation.between_epochs import in_full
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    Case,
    Check,
    Look,
    at_most,
    half_widths,
    push_harmless,
)
from rigidimeter.analysis.estimation.power_lines import lines_inside, power_lines
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.core.records import Channel, Fit
from rigidimeter.core.settings import DiagnosticsSettings

WINDOW_S = 1.0
BASELINE_QUANTILE = 0.2
"""The quietest fifth of the envelope is rest: its upper end is the baseline."""

_SHOWN = 5


def voluntary_torque(voluntary_nm: Array, signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return how much of the torque's variance is the subject's own, in the voluntary band."""
    frequency, share = power_lines(voluntary_nm, signals.rate_hz)
    low, high = settings.voluntary_low_hz, settings.voluntary_high_hz
    power = float(np.sum(share[lines_inside(frequency, (low, high))]))
    total = float(np.var(signals.torque_nm))
    value = 100.0 * power / total if total > 0 else float("nan")
    most = settings.max_voluntary_share_percent
    return at_most(
        value,
        most,
        (
            f"the torque beyond J, B and K has an SD of {np.std(voluntary_nm):.3g} N·m; its power "
            f"from {low:g} to {high:g} Hz, {power:.2g} N²m², is {in_full(value, limit=most)} % of "
            f"the torque's variance (at most {most:g} %)"
        ),
    )


def active_seconds(
    voluntary_nm: Array, signals: Signals, settings: DiagnosticsSettings
) -> tuple[Array, Array]:
    """Return the SD of M_sub in the voluntary band, second by second.

    Returns
    -------
    start_s : array, shape (m,)
        When each whole second begins, on the epoch's clock.
    sd_nm : array, shape (m,)
    """
    band = settings.voluntary_low_hz, min(settings.voluntary_high_hz, 0.45 * signals.rate_hz)
    own = zero_phase_band(voluntary_nm, signals.rate_hz, band)
    length = max(round(WINDOW_S * signals.rate_hz), 1)
    count = own.size // length
    windows = own[: count * length].reshape(count, length)
    # About zero, not about the window's mean: a push of a second is no offset.
    return signals.time_s[: count * length : length], np.sqrt(np.mean(windows**2, axis=1))


def active_movement(voluntary_nm: Array, signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return in what share of the seconds the subject pushed by itself.

    A second is active if the SD of M_sub in it is above `active_torque_nm` and above
    `active_share_percent` of the SD of the torque: what is much for an elbow is little for an
    ankle.
    """
    start_s, sd_nm = active_seconds(voluntary_nm, signals, settings)
    share = settings.active_share_percent / 100.0
    above_nm = max(settings.active_torque_nm, share * float(np.std(signals.torque_nm)))
    active = sd_nm > above_nm
    value = 100.0 * float(np.mean(active)) if active.size else float("nan")
    most = settings.max_active_percent
    when = ", ".join(f"{second:.1f} s" for second in start_s[active][:_SHOWN])
    more = " and later" if np.count_nonzero(active) > _SHOWN else ""
    return at_most(
        value,
        most,
        (
            f"the torque beyond J, B and K passes {above_nm:.2g} N·m in "
            f"{in_full(value, '.0f', limit=most)} % of the seconds (at most {most:g} %)"
            + (f", from {when}{more}" if when else "")
        ),
    )


def loop_bias(fit: Fit, unbiased: Array, settings: DiagnosticsSettings) -> Look:
    """Return how far the loop pulls least squares from the joint, in % of half the intervals."""
    bias = fit.value - unbiased
    value = 100.0 * float(np.max(np.abs(bias) / half_widths(fit)))
    most = settings.max_loop_bias_percent
    if not np.isfinite(value):
        return at_most(value, most, "no J, B and K go with this torque in this loop")
    shares = 100.0 * bias / np.abs(fit.value)
    of_each = ", ".join(
        f"{name} by {in_full(share, '+.2g')} %" for name, share in zip("JBK", shares, strict=True)
    )
    return at_most(
        value,
        most,
        (
            f"torque beyond J, B and K, which the loop turns into motion, moves {of_each}, at most "
            f"{in_full(value, limit=most)} % of half their intervals (at most {most:g} %)"
        ),
    )


def _loop_bias(case: Case) -> Look | None:
    if case.fit is None or case.unbiased is None:
        return None
    return loop_bias(case.fit, case.unbiased, case.settings)


def emg_envelope_v(emg: Channel, window_s: float) -> Array:
    """Return the moving mean of the rectified EMG, its own mean taken off first, in V."""
    length = max(round(window_s * emg.rate_hz), 1)
    rectified = np.abs(emg.values - np.mean(emg.values))
    return np.asarray(uniform_filter1d(rectified, length, mode="nearest"))


def emg_activity(emg: Channel, settings: DiagnosticsSettings) -> Look:
    """Return in what share of the time the EMG stands above its own baseline.

    A muscle that is active from beginning to end has no baseline to stand above.
    """
    envelope = emg_envelope_v(emg, settings.emg_window_s)
    baseline = float(np.quantile(envelope, BASELINE_QUANTILE))
    factor, most = settings.emg_baseline_factor, settings.max_emg_active_percent
    value = 100.0 * float(np.mean(envelope > factor * baseline))
    return at_most(
        value,
        most,
        (
            f"the EMG stands above {factor:g} times its baseline of {1e6 * baseline:.3g} µV in "
            f"{in_full(value, '.0f', limit=most)} % of the time (at most {most:g} %)"
        ),
    )


MOVEMENT_CHECKS = (
    Check(
        "loop_bias",
        (),
        _loop_bias,
        "least squares takes it for the joint, and the intervals do not include that",
        "record the perturbation and use iv; or repeat while the robot alone moves it",
    ),
    Check(
        "voluntary_torque",
        (),
        lambda c: voluntary_torque(c.voluntary_nm, c.signals, c.settings),
        (
            "least squares takes part of it for the joint, J and B come out low in the loop; iv "
            "does not, and is less precise"
        ),
        "record the perturbation, use iv and pool epochs, or leave the epoch out",
        harmless=push_harmless,
    ),
    Check(
        "active_movement",
        (),
        lambda c: active_movement(c.voluntary_nm, c.signals, c.settings),
        "something other than the robot moved it, and what was measured was not at rest",
        "repeat while the robot alone moves it, or leave these seconds out",
        harmless=push_harmless,
    ),
    Check(
        "emg_activity",
        ("emg_v",),
        lambda c: emg_activity(c.epoch.channels["emg_v"], c.settings),
        "the muscle was active",
        "ask the subject to relax and repeat, or leave the active part out",
        of_fit=False,
        harmless=push_harmless,
    ),
)
