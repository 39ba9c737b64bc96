"""The joint over frequency: torque over angle at the perturbation's lines, the model over it.

With Eq. 3 torque over angle is K − J ω² + i B ω: its magnitude is K at low frequency, dips where
ω² = K/J down to B ω and then rises with J ω²; its phase goes from 0 to 180 deg.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import LogLocator, MultipleLocator, NullLocator
from numpy.typing import NDArray

from rigidimeter.analysis.report.contents import Block, Figure, Section, paragraph
from rigidimeter.analysis.report.style import GREY, condition_colours, listed, plain_ticks, styled
from rigidimeter.analysis.study import StudyResult, split_pooled
from rigidimeter.analysis.study.drawn_signals import Response
from rigidimeter.analysis.study.over_frequency import responses
from rigidimeter.core.records import Fit
from rigidimeter.core.words import condition_name, number
from rigidimeter.model import JointDynamics

Array = NDArray[np.float64]

COHERENT = 0.5
"""Points of less coherence are hollow: most of their power is not the perturbation's."""

_MARKERS = "osD^v"
_DASHES = ("-", "--", "-.", ":")
_POINTS = 400
_READABLE = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
"""The labelled ticks of a decade: so close that K can be read off between them."""


def _blocks(result: StudyResult) -> Iterator[Block]:
    shown = responses(result)
    if not shown:
        return
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
    colours = condition_colours(result.condition_names)
    fits, _ = split_pooled(result.analysis)
    counts = "; ".join(
        f"{condition_name(key)}: {response.observed} of {response.included} included epochs"
        for key, response in shown.items()
    )
    medians = "; ".join(
        f"{condition_name(key)} {number(float(np.median(response.coherence)), 3)}"
        for key, response in shown.items()
    )
    first = next(iter(shown.values()))
    yield Figure(
        "impedance",
        f"{counts}. Median coherence: {medians}.",
        f"Torque over angle against frequency at {first.frequency_hz.size} lines of the "
        f"perturbation from {number(first.frequency_hz[0], 3)} to "
        f"{number(first.frequency_hz[-1], 3)} Hz: magnitude, phase and coherence, with the "
        f"model of each condition. Median coherence: {medians}. {counts}.",
        partial(
            impedance,
            {condition_name(key): response for key, response in shown.items()},
            {condition_name(key): colours[key] for key in shown},
            {condition_name(key): _joint(fits.get(key)) for key in shown},
        ),
        "tall",
    )


def _joint(fit: Fit | None) -> JointDynamics | None:
    if fit is None or not np.isfinite(fit.inertia_kg_m2):
        return None
    return JointDynamics(fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad)


def model_nm_rad(joint: JointDynamics, frequency_hz: Array) -> NDArray[np.complex128]:
    """Return K − J ω² + i B ω in N·m/rad."""
    omega = 2 * np.pi * frequency_hz
    J, B, K = joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad
    return np.asarray(K - J * omega**2 + 1j * B * omega, dtype=np.complex128)


def impedance(
    measured: Mapping[str, Response],
    colours: Mapping[str, str],
    joints: Mapping[str, JointDynamics | None],
) -> Drawing:
    """Draw magnitude, phase and coherence of each condition.

    Parameters
    ----------
    measured : mapping of str to Response
        By condition, at least one, each with at least two lines.
    colours : mapping of str to str
        By condition.
    joints : mapping of str to JointDynamics or None
        By condition, the joint that was fitted to all its epochs, if there is one.
    """
    lowest = min(float(r.frequency_hz[0]) for r in measured.values())
    highest = max(float(r.frequency_hz[-1]) for r in measured.values())
    with styled():
        figure = Drawing(figsize=(7.4, 6.4))
        magnitude, phase, coherence = figure.subplots(
            3, 1, sharex=True, height_ratios=(1.5, 1.1, 0.8)
        )
        for place, (name, response) in enumerate(measured.items()):
            marker = _MARKERS[place % len(_MARKERS)]
            values = response.impedance_nm_rad
            panels = (np.abs(values), np.degrees(np.angle(values)), response.coherence)
            for axes, points in zip((magnitude, phase, coherence), panels, strict=True):
                _points(axes, response, points, colours[name], marker, listed(name))
            if (joint := joints[name]) is not None:
                stiffness = joint.stiffness_nm_rad
                _model(
                    magnitude,
                    phase,
                    joint,
                    np.geomspace(lowest, highest, _POINTS),
                    colours[name],
                    _DASHES[place % len(_DASHES)],
                    f"{listed(name)}, model: K {number(stiffness, 3)} N·m/rad",
                )
                magnitude.axhline(stiffness, color=colours[name], linewidth=0.7, dashes=(2, 3))
        magnitude.set_xscale("log")
        magnitude.set_yscale("log")
        low, high = magnitude.get_ylim()
        magnitude.set_ylim(0.75 * low, high)  # K lies between two ticks
        magnitude.set_ylabel("Torque over angle\n(N·m/rad)")
        phase.set_ylabel("Phase (deg)")
        phase.set_ylim(-190, 190)
        phase.yaxis.set_major_locator(MultipleLocator(90))
        coherence.set_ylabel("Coherence (1)")
        coherence.set_ylim(-0.04, 1.04)
        coherence.set_xlabel("Frequency (Hz)")
        coherence.set_xlim(lowest / 1.1, highest * 1.1)
        coherence.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        magnitude.yaxis.set_major_locator(LogLocator(subs=_READABLE, numticks=30))
        magnitude.yaxis.set_minor_locator(NullLocator())
        plain_ticks(coherence.xaxis, magnitude.yaxis)
        figure.legend(*magnitude.get_legend_handles_labels(), loc="outside upper left", ncols=2)
        coherence.axhline(COHERENT, color=GREY, linewidth=0.6, dashes=(2, 2))
        figure.align_ylabels()
    return figure


def _points(
    axes: Axes, response: Response, values: Array, colour: str, marker: str, name: str
) -> None:
    coherent = response.coherence >= COHERENT
    for chosen, face in ((coherent, colour), (~coherent, "none")):
        if np.any(chosen):
            axes.plot(
                response.frequency_hz[chosen],
                values[chosen],
                marker,
                color=colour,
                markerfacecolor=face,
                markersize=3.0,
                markeredgewidth=0.7,
                alpha=0.55,
                label=f"{name}, measured" if face != "none" else None,
            )


def _model(
    magnitude: Axes,
    phase: Axes,
    joint: JointDynamics,
    frequency_hz: Array,
    colour: str,
    dashes: str,
    label: str,
) -> None:
    values = model_nm_rad(joint, frequency_hz)
    sizes, angles_deg = np.abs(values), np.degrees(np.angle(values))
    style: dict[str, Any] = {"color": colour, "linestyle": dashes, "linewidth": 1.2, "zorder": 3}
    magnitude.plot(frequency_hz, sizes, label=label, **style)
    phase.plot(frequency_hz, angles_deg, **style)


SECTION = Section("impedance", "Torque over angle", _blocks)
