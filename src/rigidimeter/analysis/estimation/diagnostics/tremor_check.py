"""Tremor: a line in the subject's own torque, between 4 and 12 Hz.

Parkinsonian tremor lies at 4 to 6 Hz and wanders by some tenths of a Hz, so the power of M_sub is
summed over 1 Hz. A reflex or noise lies above the perturbation's whole band; a tremor stands out of
its neighbours.

Least squares takes part of a tremor for the joint, which the loop moves at the same frequency: what
is seen of M_sub is the rest. Where the loop is known, J, B and K are freed of that part first.
"""

from __future__ import annotations

import math

import numpy as np

from rigidimeter.analysis.estimation.diagnostics.check_record import (
    Case,
    Check,
    Look,
    push_effect,
    push_harmless,
    reconstructed_torque_nm,
)
from rigidimeter.analysis.estimation.power_lines import power_lines
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.core.settings import DiagnosticsSettings

WIDTH_HZ = 1.0
STANDS_OUT = 3.0
"""The power of the line over that 1 Hz beside it, and over the median, at least."""


def tremor(voluntary_nm: Array, signals: Signals, settings: DiagnosticsSettings) -> Look | None:
    """Return the power of the strongest line in the tremor band, in % of the torque's variance.

    None where the band of the fit ends below the tremor.
    """
    low_hz, high_hz = settings.tremor_low_hz, settings.tremor_high_hz
    high_hz = min(high_hz, signals.band_hz[1] - WIDTH_HZ / 2)
    frequency, power = power_lines(voluntary_nm, signals.rate_hz, tapered=True)
    width = max(round(WIDTH_HZ / float(frequency[1])), 1)
    running = np.convolve(power, np.ones(width), "same")
    inside = np.flatnonzero((frequency >= low_hz) & (frequency <= high_hz))
    if inside.size < 3 * width:
        return None
    at = inside[int(np.argmax(running[inside]))]
    # The end of a push at low frequency has no valley on its other side.
    below, above = running[max(at - width, 0)], running[min(at + width, running.size - 1)]
    background = float(max(below, above, np.median(running[inside])))
    stands_out = float(running[at]) / max(background, 1e-300)
    variance = float(np.var(signals.torque_nm))
    value = 100.0 * float(running[at]) / variance if variance > 0 else math.nan
    near = slice(max(at - width // 2, 0), at + width // 2 + 1)
    centre_hz = float(np.average(frequency[near], weights=np.maximum(power[near], 1e-300)))
    most = settings.max_tremor_share_percent
    facts = {
        "frequency_hz": centre_hz,
        "amplitude_nm": math.sqrt(2.0 * running[at]),
        "stands_out": stands_out,
    }
    return Look(value, most, not (value <= most or stands_out < STANDS_OUT), facts)


def _own_torque(case: Case) -> Array:
    bias = case.loop_bias
    if bias is None or not np.all(np.isfinite(bias)):
        return case.voluntary_nm
    return reconstructed_torque_nm(case.signals, case.parameters - bias)


TREMOR_CHECKS = (
    Check(
        "tremor",
        (),
        lambda c: tremor(_own_torque(c), c.signals, c.settings),
        harmless=push_harmless,
        effect=push_effect,
    ),
)
