"""Whether the subject moved by itself: by the torque the joint does not explain, and by EMG.

Once J, B and K are known, so is the subject's own torque (Eq. 5):

    M_sub = J θ'' + B θ' + K θ − M_meas

Least squares makes it as small as it can, so that part of a large M_sub hides in J, B and K: what
is seen here is the least of it.
"""

from __future__ import annotations

import numpy as np
import scipy

from rigidimeter.analysis.estimation.bandlimited import zero_phase_band
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    Check,
    Look,
    at_most,
    push_effect,
    push_harmless,
)
from rigidimeter.analysis.estimation.power_lines import lines_inside, power_lines
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.core.records import Channel
from rigidimeter.core.settings import DiagnosticsSettings

WINDOW_S = 1.0
BASELINE_QUANTILE = 0.2
"""The quietest fifth of the envelope is rest: its upper end is the baseline."""


def voluntary_torque(voluntary_nm: Array, signals: Signals, settings: DiagnosticsSettings) -> Look:
    """Return how much of the torque's variance is the subject's own, in the voluntary band."""
    frequency, share = power_lines(voluntary_nm, signals.rate_hz)
    low, high = settings.voluntary_low_hz, settings.voluntary_high_hz
    power = float(np.sum(share[lines_inside(frequency, (low, high))]))
    total = float(np.var(signals.torque_nm))
    value = 100.0 * power / total if total > 0 else float("nan")
    most = settings.max_voluntary_share_percent
    sd_nm = float(np.std(voluntary_nm))
    return at_most(value, most, sd_nm=sd_nm, low_hz=low, high_hz=high)


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
    first_s = float(start_s[active][0]) if np.any(active) else float("nan")
    return at_most(value, settings.max_active_percent, above_nm=above_nm, first_s=first_s)


def emg_envelope_v(emg: Channel, window_s: float) -> Array:
    """Return the moving mean of the rectified EMG, its own mean taken off first, in V."""
    length = max(round(window_s * emg.rate_hz), 1)
    rectified = np.abs(emg.values - np.mean(emg.values))
    return np.asarray(scipy.ndimage.uniform_filter1d(rectified, length, mode="nearest"))


def emg_activity(emg: Channel, settings: DiagnosticsSettings) -> Look:
    """Return in what share of the time the EMG stands above its own baseline.

    A muscle that is active from beginning to end has no baseline to stand above.
    """
    envelope = emg_envelope_v(emg, settings.emg_window_s)
    baseline = float(np.quantile(envelope, BASELINE_QUANTILE))
    factor, most = settings.emg_baseline_factor, settings.max_emg_active_percent
    value = 100.0 * float(np.mean(envelope > factor * baseline))
    return at_most(value, most, factor=factor, baseline_uv=1e6 * baseline)


MOVEMENT_CHECKS = (
    Check(
        "voluntary_torque",
        (),
        lambda c: voluntary_torque(c.voluntary_nm, c.signals, c.settings),
        harmless=push_harmless,
        effect=push_effect,
    ),
    Check(
        "active_movement",
        (),
        lambda c: active_movement(c.voluntary_nm, c.signals, c.settings),
        harmless=push_harmless,
        effect=push_effect,
    ),
    Check(
        "emg_activity",
        ("emg_v",),
        lambda c: emg_activity(c.epoch.channels["emg_v"], c.settings),
        of_fit=False,
        harmless=push_harmless,
        effect=push_effect,
    ),
)
