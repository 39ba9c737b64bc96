"""Whether the subject moved by itself: by the torque the joint does not explain, and by EMG.

Once J, B and K are known, so is the subject's own torque (Eq. 5):

    M_sub = J θ'' + B θ' + K θ − M_meas

Least squares makes it as small as it can, so that part of a large M_sub hides in J, B and K: what
is seen here is the least of it.
"""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.active_stretches import CHECK
from rigidimeter.analysis.estimation.bandlimited import zero_phase_band
from rigidimeter.analysis.estimation.diagnostics.channel_checks import rest_of
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    HARMFUL,
    Case,
    Check,
    Harmless,
    Look,
    at_most,
    push_effect,
    push_harmless,
)
from rigidimeter.analysis.estimation.found import half_widths
from rigidimeter.analysis.estimation.power_lines import lines_inside, power_lines
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.core.findings import UNKNOWN_EFFECT, Effect, Fact
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.settings import DiagnosticsSettings
from rigidimeter.core.words import number

WINDOW_S = 1.0


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


def emg_activity(case: Case) -> Look | None:
    """Return in what share of the time a muscle was active, and what was done about it.

    Where active stretches are left out, J, B and K with them are held against those without.
    """
    prepared = case.prepared
    if prepared is None or prepared.activity is None:
        return None
    found, most = prepared.activity, case.settings.max_emg_active_percent
    value = found.active_percent
    active = (prepared.epoch.channels[one.channel] for one in found.stretches)
    muscles = dict.fromkeys(one.spoken or one.name for one in active)
    facts: dict[str, Fact] = {"channel": " and ".join(muscles)}
    if prepared.with_active is not None:
        out = [one for one in case.epoch.left_out if one.check == CHECK]
        facts |= rest_of(case.epoch, out)
        with_them = case.with_active
        if with_them is None:
            return Look(value, most, True, facts)
        change, half = with_them.value - case.parameters, half_widths(with_them)
        effect = Effect.of(change, with_them.value, half)
        moved = np.abs(change) > half
        if not np.any(moved):
            return Look(value, most, True, facts, effect=effect)
        facts["both"] = ", ".join(
            f"{p.symbol} {number(one)} with them and {number(other)} without"
            for p, one, other, shown in zip(
                PARAMETERS, with_them.value, case.parameters, moved, strict=True
            )
            if shown
        )
        return Look(value, most, True, facts, "moved", effect)
    if _locked(case):
        return Look(value, most, True, facts)
    if found.kept:
        return Look(value, most, True, {**facts, "why": found.kept}, "too_much")
    return at_most(value, most, **facts)


def _left_out_or_push(case: Case, look: Look) -> Harmless:
    """Return that what is left out, or follows the motion, does not bias the estimate."""
    if look.variant == "moved":
        return HARMFUL
    if case.prepared is not None and case.prepared.with_active is not None:
        return "left_out", {}
    if _kept(case):
        return HARMFUL  # what the joint was while the muscle pulled no method can tell
    return ("locked", {}) if _locked(case) else push_harmless(case, look)


def _effect(case: Case) -> Effect:
    return UNKNOWN_EFFECT if _kept(case) else push_effect(case)


def _kept(case: Case) -> str:
    activity = None if case.prepared is None else case.prepared.activity
    return "" if activity is None else activity.kept


def _locked(case: Case) -> bool:
    """Return whether all that the muscles do follows the motion."""
    activity = None if case.prepared is None else case.prepared.activity
    stretches = () if activity is None else activity.stretches
    return bool(stretches) and all(one.locked for one in stretches)


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
        CHECK,
        (),
        emg_activity,
        harmless=_left_out_or_push,
        effect=_effect,
    ),
)
