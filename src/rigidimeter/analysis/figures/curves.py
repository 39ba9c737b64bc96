"""Signals over time, torque over angle, and what depends on frequency."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, MultipleLocator, NullLocator
from numpy.typing import NDArray
from scipy import signal

from rigidimeter.analysis.estimation import Cycles, Signals
from rigidimeter.analysis.figures.style import (
    GREY,
    INK,
    Look,
    legend_outside,
    listed,
    note,
    write_at,
)
from rigidimeter.analysis.traces import Response, Spectrum
from rigidimeter.core.records import Channel, Epoch, Fit
from rigidimeter.core.spectrum import SEGMENT_S
from rigidimeter.core.words import amount, number
from rigidimeter.model import JointDynamics

Array = NDArray[np.float64]

WINDOW_S = 7.0
"""How much of an epoch the figures show: more would be too dense to read."""

CHANNELS = {
    "perturbation_nm": ("perturbation", "Perturbation\n(N·m)"),
    "torque_nm": ("torque", "Torque\n(N·m)"),
    "angle_rad": ("angle", "Angle\n(deg)"),
    "velocity_rad_s": ("velocity", "Velocity\n(deg/s)"),
}

TORQUE_SIZE = (7.4, 7.4)
TORQUE_HEIGHTS = (1.4, 0.7, 1.0, 1.0, 1.0)
"""Of the figure of torques in inches, and of its panels beside each other."""

EXCITATION_SIZE = (7.4, 5.8)
EXCITATION_HEIGHTS = (1.0, 1.0, 1.8)
"""Of the figure of the perturbation and its spectrum."""

COHERENT = 0.5
"""Points of less coherence are hollow: most of their power is not the perturbation's."""

_BAND = "#009E73"
_MARKERS = "osD^v"
_DASHES = ("-", "--", "-.", ":")
_READABLE = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
"""The labelled ticks of a decade: so close that K can be read off between them."""
_DOWN_TO = 1e-6
"""Densities this far below the largest are drawn at the foot of the axes."""
_NOTHING = 1e-30
_LOOP_POINTS = 2000
"""Enough for any number of cycles at the size of the figure."""


def origin_s(epoch: Epoch) -> float:
    """Return when the first channel begins."""
    return min(float(channel.time_s[0]) for channel in epoch.channels.values() if len(channel))


def _time_axis(axes: Axes) -> None:
    axes.set_xlabel("Time since the start of the epoch (s)")


def shown_channels(epoch: Epoch) -> dict[str, Channel]:
    """Return the channels that are drawn: the velocity only where there is no angle."""
    shown = {name: epoch.channels[name] for name in CHANNELS if name in epoch.channels}
    if "angle_rad" in shown:
        shown.pop("velocity_rad_s", None)
    return shown


def recorded_size(panels: int) -> tuple[float, float]:
    """Return the size of the figure in inches."""
    return 7.4, 0.4 + 1.15 * panels


def draw_recorded(
    panels: Sequence[Axes],
    channels: Mapping[str, Channel],
    start_s: float,
    span_s: float = WINDOW_S,
) -> None:
    """Draw each channel on axes of its own, from the start of the epoch on, without any filter."""
    for axes, (name, channel) in zip(panels, channels.items(), strict=True):
        # One sample beyond the end: a held or slow channel reaches the edge of the axes.
        stop = int(np.searchsorted(channel.time_s, start_s + span_s)) + 1
        time_s, values = channel.time_s[:stop] - start_s, channel.values[:stop]
        if channel.unit.startswith("rad"):
            values = np.degrees(values)
        held = "steps-post" if name == "perturbation_nm" else "default"
        axes.plot(time_s, values, drawstyle=held, color=INK, linewidth=0.9)
        axes.set_ylabel(CHANNELS[name][1])
        axes.set_xlim(0.0, span_s)
    _time_axis(panels[-1])


def changes(channel: Channel) -> tuple[Array, Array]:
    """Return the stamps and values at which a held signal changes, and its first and last."""
    values = channel.values
    keep = np.ones(values.size, dtype=bool)
    keep[1:-1] = values[1:-1] != values[:-2]
    return channel.time_s[keep], values[keep]


def draw_perturbation(panels: Sequence[Axes], channel: Channel, start_s: float) -> None:
    """Draw the perturbation on two axes, its beginning above and all of it below (Fig. 4a).

    `channel` has at least two samples; the time axis counts from `start_s` on its clock.
    """
    time_s, values = changes(channel)
    time_s = time_s - start_s
    first_s = min(WINDOW_S, time_s[-1] - time_s[0])
    for axes, stop_s in zip(panels, (time_s[0] + first_s, time_s[-1]), strict=True):
        axes.step(time_s, values, where="post", color=INK, linewidth=0.9)
        axes.set_ylabel("Perturbation\n(N·m)")
        axes.set_xlim(time_s[0], stop_s)
    _time_axis(panels[-1])
    note(panels[0], f"first {first_s:.3g} s")
    note(panels[1], "complete")


def torque_terms(signals: Signals, fit: Fit) -> Array:
    """Return the torque of inertia, damping and stiffness of a fit, shape (3, n)."""
    motion = (signals.acceleration_rad_s2, signals.velocity_rad_s, signals.angle_rad)
    return np.array([value * each for value, each in zip(fit.value, motion, strict=True)])


def _window(signals: Signals, window_s: float) -> slice:
    return slice(0, int(np.searchsorted(signals.time_s, signals.time_s[0] + window_s)) + 1)


def torque_limit_nm(signals: Signals, fit: Fit, window_s: float = WINDOW_S) -> float:
    """Return the largest size of any torque that `draw_torque` draws."""
    shown = _window(signals, window_s)
    terms = torque_terms(signals, fit)
    model = terms.sum(axis=0)
    drawn = [signals.torque_nm, model, *terms, *(signals.torque_nm - model + terms)]
    return max(float(np.max(np.abs(values[shown]))) for values in drawn)


def draw_torque(
    panels: Sequence[Axes],
    signals: Signals,
    fit: Fit,
    colour: str,
    start_s: float,
    limit_nm: float,
    window_s: float = WINDOW_S,
) -> None:
    """Draw the torque of an epoch, the model, the residual below, and the terms (Fig. 4).

    The panel of each term also shows what is left for it to explain: the measured torque less the
    two other terms of the model.

    Parameters
    ----------
    panels : sequence of Axes
        Five.
    signals : Signals
        As they entered the fit.
    fit : Fit
        Of these signals, with numbers.
    colour : str
        Of the model.
    start_s : float
        What the time axis counts from, on the epoch's clock.
    limit_nm : float
        The vertical axes reach from minus to plus this.
    window_s : float
        How much is shown, from the first sample of the signals.
    """
    shown = _window(signals, window_s)
    time_s = signals.time_s[shown] - start_s
    terms = torque_terms(signals, fit)[:, shown]
    model, measured = terms.sum(axis=0), signals.torque_nm[shown]
    residual = measured - model
    parts = [
        (f"Inertia term J θ″, J = {amount(fit.inertia_kg_m2, 'kg·m²')}", terms[0]),
        (f"Damping term B θ′, B = {amount(fit.damping_nm_s_rad, 'N·m·s/rad')}", terms[1]),
        (f"Stiffness term K θ, K = {amount(fit.stiffness_nm_rad, 'N·m/rad')}", terms[2]),
    ]
    labels = ("measured less the other terms", "this term of the model")
    pairs = [("Torque", measured, model, ("measured", "model"))]
    pairs += [(title, residual + term, term, labels) for title, term in parts]
    top, left, *below = panels
    for axes, (title, grey, line, (of_grey, of_line)) in zip((top, *below), pairs, strict=True):
        axes.plot(time_s, grey, color=GREY, linewidth=2.4, alpha=0.45, label=of_grey)
        axes.plot(time_s, line, color=colour, linewidth=0.9, label=of_line)
        axes.legend(loc="upper right", ncols=2, borderaxespad=0.1)
        axes.set_title(title, loc="left")
    note(top, f"VAF {fit.vaf_percent:.4g} %, R² {fit.r_squared:.4g}")
    left.plot(time_s, residual, color=INK, linewidth=0.8)
    left.set_title("Residual: measured less model", loc="left")
    for axes in panels:
        reach = 0.7 if axes is left else 1.35
        axes.set_ylim(-reach * limit_nm, reach * limit_nm)
        axes.set_xlim(time_s[0], time_s[-1])
        axes.set_ylabel("Torque (N·m)")
    _time_axis(panels[-1])


def loop_limits(epochs: Iterable[Cycles]) -> tuple[float, float]:
    """Return how far the axes must reach to hold these loops: angle in deg, torque in N·m."""
    sizes = [
        (float(np.max(np.abs(np.degrees(c.angle_rad)))), float(np.max(np.abs(c.torque_nm))))
        for c in epochs
    ]
    return 1.08 * max(angle for angle, _ in sizes), 1.08 * max(torque for _, torque in sizes)


def draw_loops(
    panels: Sequence[Axes],
    shown: Sequence[tuple[str, Cycles, str]],
    limits: tuple[float, float] | None = None,
    remark: str = "",
) -> None:
    """Draw the loops of epochs in one panel; their mean area is the work per cycle (Fig. 7).

    Parameters
    ----------
    panels : sequence of Axes
        One.
    shown : sequence of (str, Cycles, str)
        What the legend says of an epoch, the cycles that were scored, and the colour.
    limits : (float, float), optional
        As `loop_limits` gives them; default: those of these epochs.
    remark : str
        A few words above the axes.
    """
    (axes,) = panels
    across, up = limits or loop_limits(cycles for _, cycles, _ in shown)
    for label, cycles, colour in shown:
        every = slice(None, None, max(1, cycles.time_s.size // _LOOP_POINTS))
        angle_deg, torque_nm = np.degrees(cycles.angle_rad[every]), cycles.torque_nm[every]
        axes.plot(angle_deg, torque_nm, color=colour, lw=0.8, label=listed(label) or None)
    axes.set_xlim(-across, across)
    axes.set_ylim(-up, up)
    axes.set_xlabel("Angle (deg)")
    axes.set_ylabel("Torque (N·m)")
    note(axes, remark)
    if any(label for label, _, _ in shown):
        legend_outside(axes)


def frequency_axis(axes: Axes, low: float, high: float) -> None:
    """Make the horizontal axis one of frequency in Hz, logarithmic."""
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.set_xlabel("Frequency (Hz)")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.grid(visible=False, which="minor")


def _density_axis(axes: Axes, low: float, high: float) -> None:
    frequency_axis(axes, low, high)
    axes.set_yscale("log")
    axes.set_ylabel("Power spectral density\n((N·m)²/Hz)")


def draw_spectrum(panels: Sequence[Axes], channel: Channel, wanted_hz: tuple[float, float]) -> None:
    """Draw the one-sided power spectral density with the wanted band marked (Fig. 3b).

    From a Hann-windowed periodogram; the perturbation is held between its samples.

    Parameters
    ----------
    panels : sequence of Axes
        One.
    channel : Channel
        `perturbation_nm`, at least 16 samples, not constant.
    wanted_hz : (float, float)
        The band that the perturbation is meant to excite.
    """
    (axes,) = panels
    rate_hz = channel.rate_hz
    count = int((channel.time_s[-1] - channel.time_s[0]) * rate_hz) + 1
    grid = channel.time_s[0] + np.arange(count) / rate_hz
    # A hundredth of a sample of rounding must not hold the value before.
    index = np.searchsorted(channel.time_s, grid + 0.01 / rate_hz, side="right") - 1
    frequency_hz, density = signal.periodogram(channel.values[index], rate_hz, window="hann")
    low, high = wanted_hz
    shown = (frequency_hz > 0) & (frequency_hz <= max(4 * high, 5 * frequency_hz[1]))
    frequency_hz, density = frequency_hz[shown], density[shown]
    axes.axvspan(low, high, color=_BAND, alpha=0.12, linewidth=0)
    floor = density.max() * 1e-5
    axes.plot(frequency_hz, np.maximum(density, floor), color=INK, linewidth=0.8)
    _density_axis(axes, min(frequency_hz[0], low / 2), max(frequency_hz[-1], 2 * high))
    axes.set_ylim(floor, density.max() * 6)
    look: Look = {"ha": "center", "va": "top", "color": GREY}
    words = f"intended: {low:g} to {high:g} Hz"
    write_at(axes, float(np.sqrt(low * high)), 0.97, words, share="y", **look)


def draw_excitation(
    panels: Sequence[Axes], channel: Channel, start_s: float, wanted_hz: tuple[float, float]
) -> None:
    """Draw the perturbation on two panels and its spectrum on a third."""
    draw_perturbation(panels[:2], channel, start_s)
    draw_spectrum(panels[2:], channel, wanted_hz)


def draw_unexplained(
    panels: Sequence[Axes],
    spectra: Sequence[Spectrum],
    colours: Mapping[str, str],
    labels: Mapping[str, str],
    band_hz: tuple[float, float],
) -> None:
    """Draw the spectrum of each epoch thin and the mean of each condition thick.

    Parameters
    ----------
    panels : sequence of Axes
        One.
    spectra : sequence of Spectrum
    colours, labels : mapping of str to str
        By condition.
    band_hz : (float, float)
        What is shown: outside of it the signals were filtered away.
    """
    (axes,) = panels
    low, high = band_hz
    # Without any torque left there is still a figure: a line at its foot.
    largest = max(float(np.max(one.density[_within(one, band_hz)], initial=0.0)) for one in spectra)
    floor = max(largest * _DOWN_TO, _NOTHING)
    for condition, label in labels.items():
        own = [one for one in spectra if one.condition == condition]
        colour = colours[condition]
        grid = own[0].frequency_hz[_within(own[0], band_hz)]
        for one in own:
            inside = _within(one, band_hz)
            drawn = np.maximum(one.density[inside], floor)
            axes.plot(one.frequency_hz[inside], drawn, color=colour, linewidth=0.5, alpha=0.35)
        mean = np.mean([np.interp(grid, one.frequency_hz, one.density) for one in own], axis=0)
        axes.plot(grid, np.maximum(mean, floor), color=colour, lw=1.8, label=listed(label))
    _density_axis(axes, max(low, 1 / SEGMENT_S), high)
    axes.legend(loc="lower left")


def _within(one: Spectrum, band_hz: tuple[float, float]) -> NDArray[np.bool_]:
    return (one.frequency_hz >= band_hz[0]) & (one.frequency_hz <= band_hz[1])


def model_nm_rad(joint: JointDynamics, frequency_hz: Array) -> NDArray[np.complex128]:
    """Return K − J ω² + i B ω in N·m/rad."""
    omega = 2 * np.pi * frequency_hz
    J, B, K = joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad
    return np.asarray(K - J * omega**2 + 1j * B * omega, dtype=np.complex128)


def draw_impedance(
    panels: Sequence[Axes],
    measured: Mapping[str, Response],
    colours: Mapping[str, str],
    joints: Mapping[str, JointDynamics],
) -> None:
    """Draw magnitude, phase and coherence of torque over angle of each condition.

    With Eq. 3 torque over angle is K − J ω² + i B ω: its magnitude is K at low frequency, dips
    where ω² = K/J down to B ω and then rises with J ω²; its phase goes from 0 to 180 deg.

    Parameters
    ----------
    panels : sequence of Axes
        Three.
    measured : mapping of str to Response
        By condition, at least one, each with at least two lines.
    colours : mapping of str to str
        By condition.
    joints : mapping of str to JointDynamics
        By condition, the joint that was fitted to all its epochs, where there is one.
    """
    magnitude, phase, coherence = panels
    lowest = min(float(r.frequency_hz[0]) for r in measured.values())
    highest = max(float(r.frequency_hz[-1]) for r in measured.values())
    magnitude.set_yscale("log")
    for place, (name, response) in enumerate(measured.items()):
        colour, values = colours[name], response.impedance_nm_rad
        coherent = response.coherence >= COHERENT
        look: Look = {"color": colour, "ms": 3.0, "mew": 0.7, "alpha": 0.55}
        marker = _MARKERS[place % len(_MARKERS)]
        shown = np.abs(values), np.degrees(np.angle(values)), response.coherence
        for axes, points in zip(panels, shown, strict=True):
            for chosen, face in ((coherent, colour), (~coherent, "none")):
                if np.any(chosen):
                    label = f"{listed(name)}, measured" if face == colour else None
                    at = response.frequency_hz[chosen], points[chosen]
                    axes.plot(*at, marker, mfc=face, label=label, **look)
        if (joint := joints.get(name)) is not None:
            grid = np.geomspace(lowest, highest, 400)
            model = model_nm_rad(joint, grid)
            stiffness = joint.stiffness_nm_rad
            label = f"{listed(name)}, model: K {number(stiffness, 3)} N·m/rad"
            for axes, curve in ((magnitude, np.abs(model)), (phase, np.degrees(np.angle(model)))):
                dashes = _DASHES[place % len(_DASHES)]
                axes.plot(grid, curve, color=colour, ls=dashes, zorder=3, label=label)
            magnitude.axhline(stiffness, color=colour, linewidth=0.7, dashes=(2, 3))
    low, high = magnitude.get_ylim()
    magnitude.set_ylim(0.75 * low, high)  # K lies between two ticks
    magnitude.set_ylabel("Torque over angle\n(N·m/rad)")
    magnitude.yaxis.set_major_locator(LogLocator(subs=_READABLE, numticks=30))
    magnitude.yaxis.set_minor_locator(NullLocator())
    phase.set_ylabel("Phase (deg)")
    phase.set_ylim(-190, 190)
    phase.yaxis.set_major_locator(MultipleLocator(90))
    coherence.set_ylabel("Coherence (1)")
    coherence.set_ylim(-0.04, 1.04)
    coherence.axhline(COHERENT, color=GREY, linewidth=0.6, dashes=(2, 2))
    for axes in panels:
        frequency_axis(axes, lowest / 1.1, highest * 1.1)
        axes.set_xlabel("Frequency (Hz)" if axes is coherence else "")
    legend_outside(magnitude)
