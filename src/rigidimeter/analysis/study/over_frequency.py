"""The joint and the torque that it does not explain, over frequency, from the samples of epochs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.analysis.estimation.bandlimited import bandlimited_signals
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.closedloop.observe import observe_periods
from rigidimeter.analysis.estimation.closedloop.periodic_response import impedance
from rigidimeter.analysis.estimation.diagnostics import reconstructed_torque_nm
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.study.drawn_signals import Response, Spectrum
from rigidimeter.analysis.study.examples import prepared_epochs
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.core.spectrum import density

FEWEST_LINES = 2
SAME_FREQUENCY = 1e-3
"""Lines of two epochs that differ by less than this fraction are the same line."""


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
        observations = same_lines(_observations(epochs))
        if not observations:
            continue
        found = impedance(observations)
        if found.frequency_hz.size >= FEWEST_LINES:
            shown[condition] = Response(*found, len(observations), len(epochs))
    return shown


def _observations(epochs: Sequence[PreparedEpoch]) -> list[Observation]:
    """Return the epochs that can be observed at the lines of their perturbation."""
    found = []
    for epoch in epochs:
        try:
            found.append(epoch.once(observe_periods))
        except ValueError:
            continue  # it does not repeat, or was not recorded: the page says what is needed
    return found


def same_lines(observations: Sequence[Observation]) -> list[Observation]:
    """Return the largest set of epochs that have their excited lines at the same frequencies."""
    groups: list[list[Observation]] = []
    for observation in observations:
        lines = observation.grid.omega_rad_s[observation.excited]
        for group in groups:
            known = group[0].grid.omega_rad_s[group[0].excited]
            if known.size == lines.size and np.allclose(known, lines, rtol=SAME_FREQUENCY):
                group.append(observation)
                break
        else:
            groups.append([observation])
    return max(groups, key=len, default=[])


def unexplained_spectra(result: StudyResult) -> tuple[Spectrum, ...]:
    """Return the spectrum of the torque that J, B and K leave, of each included fit."""
    found = []
    by_name = prepared_epochs(result)
    for fit in result.analysis.fits:
        epoch = by_name.get((fit.source, fit.epoch))
        if epoch is None or not fit.outcome.included:
            continue
        signals = epoch.signals(bandlimited_signals)
        own_nm = reconstructed_torque_nm(signals, fit.value)
        frequency_hz, power = density(own_nm, signals.rate_hz)
        low, high = signals.band_hz
        inside = (frequency_hz >= low) & (frequency_hz <= high)
        found.append(
            Spectrum(
                fit.condition,
                frequency_hz[inside],
                power[inside],
                float(np.std(own_nm)),
                signals.band_hz,
            )
        )
    return tuple(found)
