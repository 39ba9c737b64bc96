"""Model fit: the torque of an epoch, torque over angle, what is left, and loops."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial

import numpy as np
from markupsafe import Markup

from rigidimeter.analysis.estimation import Signals, epoch_signals, scoring_cycles
from rigidimeter.analysis.figures import (
    TORQUE_HEIGHTS,
    TORQUE_SIZE,
    WINDOW_S,
    Look,
    condition_colours,
    draw_impedance,
    draw_loops,
    draw_torque,
    draw_unexplained,
    drawn,
    origin_s,
    torque_limit_nm,
)
from rigidimeter.analysis.recording import split_pooled
from rigidimeter.analysis.report.contents import Block, Figure, Section, named, paragraph, part
from rigidimeter.analysis.report.methods import method_of
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.traces import (
    analysed_epoch,
    representative_fits,
    representative_scores,
    responses,
    unexplained_spectra,
)
from rigidimeter.core.records import Fit
from rigidimeter.core.words import amount, condition_name, number
from rigidimeter.model import JointDynamics


def _torque(shown: Shown) -> Iterator[Block]:
    colours = condition_colours(shown.condition_names)
    found = [
        (fit, epoch, epoch_signals(epoch, shown.study.settings, fit.method))
        for fit in representative_fits(shown.analysis, shown.condition_names)
        if (epoch := analysed_epoch(shown.as_analysed, fit)) is not None
    ]
    if not found:
        return
    text = (
        "The model is the J, B and K of that epoch, as in the results. The panels of inertia, "
        "damping and stiffness show, in grey, what is left for that term to explain: the measured "
        "torque less the other two terms. These panels have the same axis in all conditions."
    )
    if method_of(shown.analysis.method).uses_perturbation:
        text += (
            " The estimate ignores torque that does not follow the perturbation. What the model "
            "leaves here is noise and torque not from the robot, so a low VAF does not "
            "mean a poor fit."
        )
    yield paragraph(text)
    below: Look = {"sharex": True, "height_ratios": TORQUE_HEIGHTS}
    limit_nm = max(torque_limit_nm(signals, fit) for fit, _, signals in found)
    for position, (fit, epoch, signals) in enumerate(found, start=1):
        name = condition_name(fit.condition)
        stiffness = amount(fit.stiffness_nm_rad, "N·m/rad", 3)
        vaf = f"{number(fit.vaf_percent)} %"
        drawing = signals, fit, colours[fit.condition], origin_s(epoch), limit_nm
        yield Figure(
            f"torque_{position}_{_file_name(fit.condition)}",
            f"{name}: {named(shown, fit)}, the included epoch with the median stiffness "
            f"({stiffness}); its first {WINDOW_S:g} s in the band {_hz(signals.band_hz)}"
            f"{_fitted_elsewhere(signals, fit)}.",
            f"{name}: measured and modelled torque of {named(shown, fit)}, what the model leaves, "
            f"and the terms of inertia, damping and stiffness. K {stiffness}, VAF {vaf}.",
            partial(drawn, TORQUE_SIZE, draw_torque, *drawing, rows=5, **below),
            "tall",
        )


def _file_name(condition: str) -> str:
    """Return a name that every file system takes; two conditions may get the same one."""
    return re.sub(r"[^A-Za-z0-9]+", "-", condition).strip("-").lower()[:40] or "unnamed"


def _hz(band_hz: tuple[float, float]) -> str:
    return f"{number(band_hz[0], 3)} to {number(band_hz[1], 3)} Hz"


def _fitted_elsewhere(signals: Signals, fit: Fit) -> str:
    """Return the band of the fit where it is not the one that is drawn."""
    if fit.band_hz == signals.band_hz:
        return ""
    return f"; fit and VAF use the band {_hz(fit.band_hz)}"


def _impedance(shown: Shown) -> Iterator[Block]:
    found = responses(shown.analysis, shown.condition_names, shown.as_analysed)
    if not found:
        return
    measured = {condition_name(key): response for key, response in found.items()}
    yield paragraph(
        Markup(
            "Torque over angle at the frequencies of the perturbation, without any model, averaged "
            "over the epochs of each condition. Hollow points have a coherence below 0.5. The line "
            "is the model of all epochs together, "
            '<span class="formula">K − J ω² + i B ω</span>; the broken line across is its K, which '
            "the magnitude approaches at low frequency. Bottom panel: the coherence of the "
            "torque with what repeats, 1 where nothing but the perturbation moved the joint. A "
            "point of coherence γ² has a relative uncertainty of about √(1/γ² − 1): a tenth at "
            "0.99, a third at 0.9."
        )
    )
    colours = condition_colours(map(condition_name, shown.condition_names))
    fits, _ = split_pooled(shown.analysis)
    joints = {
        condition_name(key): JointDynamics(*fit.value)
        for key, fit in fits.items()
        if np.isfinite(fit.inertia_kg_m2)
    }
    counts = "; ".join(
        f"{name}: {response.observed} of {response.included} included epochs"
        for name, response in measured.items()
    )
    medians = "; ".join(
        f"{name} {number(float(np.median(response.coherence)), 3)}"
        for name, response in measured.items()
    )
    drawing = measured, colours, joints
    below: Look = {"sharex": True, "height_ratios": (1.5, 1.1, 0.8)}
    lines_hz = next(iter(measured.values())).frequency_hz
    yield Figure(
        "impedance",
        f"{counts}. Median coherence: {medians}.",
        f"Torque over angle against frequency at {lines_hz.size} lines of the "
        f"perturbation from {number(lines_hz[0], 3)} to {number(lines_hz[-1], 3)} Hz: magnitude, "
        "phase and coherence, with the "
        f"model of each condition. Median coherence: {medians}. {counts}.",
        partial(drawn, (7.4, 6.4), draw_impedance, *drawing, rows=3, **below),
        "tall",
    )


def _unexplained(shown: Shown) -> Iterator[Block]:
    spectra = unexplained_spectra(shown.analysis, shown.as_analysed)
    if not spectra:
        return
    text = Markup(
        "The torque of each epoch that J, B and K do not explain, "
        '<span class="formula">J θ″ + B θ′ + K θ − M</span>: torque not from the robot, '
        "sensor noise, and whatever the model lacks. Voluntary movement is below 4 Hz; a tremor is "
        "a peak."
    )
    if not method_of(shown.analysis.method).by_noise:
        text += " Least squares makes this torque as small as it can, and so hides part of it."
    yield paragraph(text)
    sizes_nm = {
        key: own
        for key in shown.condition_names
        if (own := [one.sd_nm for one in spectra if one.condition == key])
    }
    labels = {
        key: f"{condition_name(key)}: SD {number(float(np.median(own)), 3)} N·m "
        f"(median of {len(own)})"
        for key, own in sizes_nm.items()
    }
    ranges = "; ".join(
        f"{condition_name(key)} {number(min(own), 3)} to {number(max(own), 3)}"
        for key, own in sizes_nm.items()
    )
    band_hz = max(one.band_hz[0] for one in spectra), min(one.band_hz[1] for one in spectra)
    colours = condition_colours(shown.condition_names)
    yield Figure(
        "voluntary_spectrum",
        "Thin: every included epoch. Thick: the mean of each condition. SD of the epochs, in N·m: "
        f"{ranges}.",
        f"Power spectral density of the torque that J, B and K do not explain, {_hz(band_hz)}. "
        f"{'; '.join(labels.values())}.",
        partial(drawn, (7.4, 3.0), draw_unexplained, spectra, colours, labels, band_hz),
    )


def _loops(shown: Shown) -> Iterator[Block]:
    colours = condition_colours(shown.condition_names)
    found = [
        (score, scoring_cycles(epoch, shown.study.settings.scores))
        for score in representative_scores(shown.analysis, shown.condition_names)
        if (epoch := analysed_epoch(shown.as_analysed, score)) is not None
    ]
    if not found:
        return
    yield paragraph(
        "Torque against angle during the imposed sinusoid, both band-pass filtered in the same "
        "way. The area of a loop is the work of one cycle."
    )
    works = [
        f"{condition_name(score.condition)}: {number(score.work_j)} J per cycle"
        for score, _ in found
    ]
    epochs = "; ".join(
        f"{condition_name(score.condition)}: {named(shown, score)}, {cycles.n_cycles} cycles at "
        f"{number(cycles.frequency_hz, 3)} Hz"
        for score, cycles in found
    )
    drawing = [
        (words, cycles, colours[score.condition])
        for words, (score, cycles) in zip(works, found, strict=True)
    ]
    yield Figure(
        "loops",
        f"The included epochs with the median work. {epochs}.",
        f"Torque against angle. {'; '.join(works)}. {epochs}.",
        partial(drawn, (5.2, 3.6), draw_loops, drawing),
    )


SECTIONS = part(
    "Model fit",
    Section("torque", "Measured and modelled torque", _torque),
    Section("impedance", "Torque over angle", _impedance),
    Section("voluntary", "Unexplained torque", _unexplained),
    Section("loops", "Torque–angle loops", _loops),
    printed=1,
)
