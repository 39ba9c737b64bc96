"""The joint and the torque that it does not explain, over frequency, from the samples of epochs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import epoch_signals, impedance
from rigidimeter.analysis.traces.examples import Prepared
from rigidimeter.core.records import Analysis
from rigidimeter.core.spectrum import density

Array = NDArray[np.float64]

FEWEST_LINES = 2


@dataclass(frozen=True)
class Response:
    """The measured impedance of one condition at the lines of the perturbation.

    Attributes
    ----------
    frequency_hz, coherence : arrays, shape (m,)
    impedance_nm_rad : array of complex, shape (m,)
    observed, included : int
        Epochs that it is made of, and epochs of the condition that count.
    """

    frequency_hz: Array
    impedance_nm_rad: NDArray[np.complex128]
    coherence: Array
    observed: int
    included: int


@dataclass(frozen=True)
class Spectrum:
    """The torque of one epoch that J, B and K do not explain.

    Attributes
    ----------
    condition : str
    frequency_hz, density : arrays, shape (n,)
        One-sided power spectral density in (N·m)²/Hz, within the band of the epoch.
    sd_nm : float
    band_hz : (float, float)
    """

    condition: str
    frequency_hz: Array
    density: Array
    sd_nm: float
    band_hz: tuple[float, float]


def responses(analysis: Analysis, names: Iterable[str], prepared: Prepared) -> dict[str, Response]:
    """Return torque over angle of each condition, without a model, where its epochs allow it.

    Parameters
    ----------
    analysis : Analysis
    names : iterable of str
        The conditions; the responses come in their order.
    prepared : mapping of (str, str) to Ready
        As `prepared_epochs` returns it.
    """
    shown: dict[str, Response] = {}
    for condition in names:
        epochs = [
            prepared[fit.source, fit.epoch]
            for fit in analysis.fits
            if fit.condition == condition and fit.outcome.included
            if (fit.source, fit.epoch) in prepared
        ]
        found = impedance(epochs)
        if found is not None and found.frequency_hz.size >= FEWEST_LINES:
            shown[condition] = Response(*found, len(epochs))
    return shown


def unexplained_spectra(analysis: Analysis, prepared: Prepared) -> tuple[Spectrum, ...]:
    """Return the spectrum of the torque that J, B and K leave, of each included fit."""
    found = []
    for fit in analysis.fits:
        ready = prepared.get((fit.source, fit.epoch))
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
