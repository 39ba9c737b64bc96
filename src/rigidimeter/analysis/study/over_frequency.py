"""The joint and the torque that it does not explain, over frequency, from the samples of epochs."""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation import epoch_signals, impedance
from rigidimeter.analysis.study.drawn_signals import Response, Spectrum
from rigidimeter.analysis.study.examples import prepared_epochs
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.core.spectrum import density

FEWEST_LINES = 2


def responses(result: StudyResult) -> dict[str, Response]:
    """Return torque over angle of each condition, without a model, where its epochs allow it."""
    shown: dict[str, Response] = {}
    prepared = prepared_epochs(result)
    for condition in result.condition_names:
        epochs = [
            prepared[fit.source, fit.epoch]
            for fit in result.analysis.fits
            if fit.condition == condition and fit.outcome.included
            if (fit.source, fit.epoch) in prepared
        ]
        found = impedance(epochs)
        if found is not None and found.frequency_hz.size >= FEWEST_LINES:
            shown[condition] = Response(*found, len(epochs))
    return shown


def unexplained_spectra(result: StudyResult) -> tuple[Spectrum, ...]:
    """Return the spectrum of the torque that J, B and K leave, of each included fit."""
    found = []
    by_name = prepared_epochs(result)
    for fit in result.analysis.fits:
        ready = by_name.get((fit.source, fit.epoch))
        if ready is None or not fit.outcome.included:
            continue
        signals = epoch_signals(ready.epoch, ready.settings, "bandlimited", ready.drive)
        left_nm = signals.torque_nm - signals.motion @ fit.value
        frequency_hz, power = density(left_nm, signals.rate_hz)
        low, high = signals.band_hz
        inside = (frequency_hz >= low) & (frequency_hz <= high)
        found.append(
            Spectrum(
                fit.condition,
                frequency_hz[inside],
                power[inside],
                float(np.std(left_nm)),
                signals.band_hz,
            )
        )
    return tuple(found)
