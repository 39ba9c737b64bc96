"""The joint and the subject's own torque over frequency."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.estimation import aligned, epoch_signals
from rigidimeter.estimation.closedloop.observation import Observation, observe_periods
from rigidimeter.estimation.closedloop.periodic_response import impedance as without_model
from rigidimeter.estimation.diagnostics import reconstructed_torque_nm
from rigidimeter.estimation.prepared import prepare
from rigidimeter.records import Epoch, Fit
from rigidimeter.reporting.figures import condition_colours
from rigidimeter.reporting.figures.impedance import Response, impedance
from rigidimeter.reporting.figures.unexplained_torque import density, voluntary_spectrum
from rigidimeter.reporting.measures import condition_name
from rigidimeter.reporting.numbers import number
from rigidimeter.reporting.pictures.stored_figure import Picture, analysed_epoch, drawn
from rigidimeter.study import StudyResult, split_pooled

__all__ = ["impedance_pictures", "voluntary_pictures"]

FEWEST_LINES = 2
SAME_FREQUENCY = 1e-3
"""Lines of two epochs that differ by less than this fraction are the same line."""


def impedance_pictures(study: StudyResult) -> list[Picture]:
    """Return torque over angle at the perturbation's lines with the model over it.

    Only from included epochs whose perturbation was recorded and repeats.
    """
    fits, _ = split_pooled(study.analysis)
    shown: dict[str, Response] = {}
    used: dict[str, tuple[int, int]] = {}
    for condition in study.condition_names:
        epochs = [
            epoch
            for fit in study.analysis.fits
            if fit.condition == condition and fit.outcome.included
            if (epoch := analysed_epoch(study, fit)) is not None
        ]
        observations = alike(_observations(study, epochs))
        if not observations:
            continue
        found = without_model(observations)
        if found.frequency_hz.size < FEWEST_LINES:
            continue
        shown[condition] = Response(*found, _joint(fits.get(condition)))
        used[condition] = len(observations), len(epochs)
    if not shown:
        return []
    colours = condition_colours(study.condition_names)
    figure = impedance(
        {condition_name(key): response for key, response in shown.items()},
        {condition_name(key): colours[key] for key in shown},
    )
    counts = "; ".join(
        f"{condition_name(key)}: {some} of {every} included epochs"
        for key, (some, every) in used.items()
    )
    medians = "; ".join(
        f"{condition_name(key)} {number(float(np.median(response.coherence)), 3)}"
        for key, response in shown.items()
    )
    first = next(iter(shown.values()))
    return [
        Picture(
            "impedance",
            drawn(study, figure),
            f"Torque over angle against frequency at {first.frequency_hz.size} lines of the "
            f"perturbation from {number(first.frequency_hz[0], 3)} to "
            f"{number(first.frequency_hz[-1], 3)} Hz: magnitude, phase and coherence, with the "
            f"model of each condition. Median coherence: {medians}. {counts}.",
            f"{counts}. Median coherence: {medians}.",
        )
    ]


def _observations(study: StudyResult, epochs: Sequence[Epoch]) -> list[Observation]:
    """Return the epochs that can be seen at the lines of their perturbation."""
    found = []
    for epoch in prepare(epochs, study.settings):
        try:
            found.append(observe_periods(epoch))
        except ValueError:
            continue  # it does not repeat, or was not recorded: the page says what is needed
    return found


def alike(observations: Sequence[Observation]) -> list[Observation]:
    """Return the largest set of epochs that have their excited lines at the same frequencies."""
    groups: list[list[Observation]] = []
    for observation in observations:
        lines = observation.lines.grid.omega_rad_s[observation.excited]
        for group in groups:
            known = group[0].lines.grid.omega_rad_s[group[0].excited]
            if known.size == lines.size and np.allclose(known, lines, rtol=SAME_FREQUENCY):
                group.append(observation)
                break
        else:
            groups.append([observation])
    return max(groups, key=len, default=[])


def _joint(fit: Fit | None) -> JointDynamics | None:
    if fit is None or not np.isfinite(fit.inertia_kg_m2):
        return None
    return JointDynamics(fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad)


def voluntary_pictures(study: StudyResult) -> list[Picture]:
    """Return the spectrum of what J, B and K leave of the torque, epoch by epoch."""
    spectra: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    sizes_nm: dict[str, list[float]] = {}
    bands = []
    by_name = {(epoch.source, epoch.label): epoch for epoch in study.epochs}
    for fit in study.analysis.fits:
        epoch = by_name.get((fit.source, fit.epoch))
        if epoch is None or not fit.outcome.included:
            continue
        whole = aligned(epoch, study.analysis.delays)
        signals = epoch_signals(whole, "bandlimited", study.settings.estimation)
        parameters = fit.value
        own_nm = reconstructed_torque_nm(signals, parameters)
        spectra.setdefault(fit.condition, []).append(density(own_nm, signals.rate_hz))
        sizes_nm.setdefault(fit.condition, []).append(float(np.std(own_nm)))
        bands.append(signals.band_hz)
    if not spectra:
        return []
    order = [condition for condition in study.condition_names if condition in spectra]
    labels = {
        key: f"{condition_name(key)}: SD {number(float(np.median(sizes_nm[key])), 3)} N·m "
        f"(median of {len(sizes_nm[key])})"
        for key in order
    }
    band_hz = max(low for low, _ in bands), min(high for _, high in bands)
    figure = voluntary_spectrum(
        {key: spectra[key] for key in order},
        condition_colours(study.condition_names),
        labels,
        band_hz,
    )
    ranges = "; ".join(
        f"{condition_name(key)} {number(min(sizes_nm[key]), 3)} to {number(max(sizes_nm[key]), 3)}"
        for key in order
    )
    return [
        Picture(
            "voluntary_spectrum",
            drawn(study, figure),
            f"Power spectral density of what J, B and K leave of the torque, "
            f"{number(band_hz[0], 3)} to {number(band_hz[1], 3)} Hz. {'; '.join(labels.values())}.",
            f"Every included epoch thin, the mean of each condition thick. SD by epoch, in N·m: "
            f"{ranges}.",
        )
    ]
