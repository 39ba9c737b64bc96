"""The joint over frequency: torque over angle at the perturbation's lines, the model over it.

With Eq. 3 torque over angle is K − J ω² + i B ω: its magnitude is K at low frequency, dips where
ω² = K/J down to B ω and then rises with J ω²; its phase goes from 0 to 180 deg.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MultipleLocator
from numpy.typing import NDArray

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.reporting.figures.style import GREY, listed, styled

__all__ = ["COHERENT", "Response", "impedance", "model_nm_rad"]

Array = NDArray[np.float64]

COHERENT = 0.5
"""Below this coherence a point is drawn hollow: most of its power is not the perturbation's."""

_MARKERS = "osD^v"
_DASHES = ("-", "--", "-.", ":")
_POINTS = 400


class Response(NamedTuple):
    """The measured impedance of one condition, and the joint fitted to it if there is one."""

    frequency_hz: Array
    impedance_nm_rad: NDArray[np.complex128]
    coherence: Array
    joint: JointDynamics | None


def model_nm_rad(joint: JointDynamics, frequency_hz: Array) -> NDArray[np.complex128]:
    """Return K − J ω² + i B ω in N·m/rad."""
    omega = 2 * np.pi * frequency_hz
    J, B, K = joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad
    return np.asarray(K - J * omega**2 + 1j * B * omega, dtype=np.complex128)


def impedance(responses: Mapping[str, Response], colours: Mapping[str, str]) -> Figure:
    """Draw magnitude, phase and coherence of each condition.

    Parameters
    ----------
    responses : mapping of str to Response
        By condition, at least one, each with at least two lines.
    colours : mapping of str to str
        By condition.
    """
    lowest = min(float(r.frequency_hz[0]) for r in responses.values())
    highest = max(float(r.frequency_hz[-1]) for r in responses.values())
    with styled():
        figure = Figure(figsize=(7.4, 6.4))
        magnitude, phase, coherence = figure.subplots(
            3, 1, sharex=True, height_ratios=(1.5, 1.1, 0.8)
        )
        for place, (name, response) in enumerate(responses.items()):
            marker = _MARKERS[place % len(_MARKERS)]
            values = response.impedance_nm_rad
            measured = (np.abs(values), np.degrees(np.angle(values)), response.coherence)
            for axes, points in zip((magnitude, phase, coherence), measured, strict=True):
                _points(axes, response, points, colours[name], marker, listed(name))
            if response.joint is not None:
                _model(
                    magnitude,
                    phase,
                    response.joint,
                    np.geomspace(lowest, highest, _POINTS),
                    colours[name],
                    _DASHES[place % len(_DASHES)],
                    f"{listed(name)}, model",
                )
        magnitude.set_xscale("log")
        magnitude.set_yscale("log")
        magnitude.set_ylabel("Torque over angle\n(N·m/rad)")
        phase.set_ylabel("Phase (deg)")
        phase.set_ylim(-190, 190)
        phase.yaxis.set_major_locator(MultipleLocator(90))
        coherence.set_ylabel("Coherence (1)")
        coherence.set_ylim(-0.04, 1.04)
        coherence.set_xlabel("Frequency (Hz)")
        coherence.set_xlim(lowest / 1.1, highest * 1.1)
        coherence.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        for axis in (coherence.xaxis, magnitude.yaxis):
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        magnitude.grid(visible=False, which="minor")
        magnitude.legend(loc="upper left", ncols=2)
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
