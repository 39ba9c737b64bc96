"""Fig. 1 and 2: the rig and its block diagram, drawn, and what can be computed of them.

The weight of a forearm of mass m, whose centre is l from an axis that is tilted by α from the
vertical, adds at most m g l sin α to the stiffness (Sec. 2.2). The controller of Fig. 2(c) is the
low-pass of Sec. 2.4.1 and 1/(J_c s + B_c).
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.patches import Arc, Circle, FancyBboxPatch, Polygon, Rectangle
from scipy.constants import g

from rigidimeter.analysis.figures import GREY, styled
from rigidimeter.analysis.report import Figure
from rigidimeter.core.words import number
from rigidimeter.model import (
    BiquadState,
    admittance,
    admittance_step,
    biquad_step,
    butterworth_lowpass,
)
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import Claim, bounded, within_percent
from rigidimeter.paper.context import Context
from rigidimeter.planning import Forearm

_TILT_DEG = 5.0
"""An axis that is mounted by eye is within this of the vertical."""

_SINE_HZ, _CYCLES = 1.0, 10

_ARM, _SUBJECT, _LINE = "#CFE3F1", "#F3E3D3", "#222222"


def figure_1(context: Context) -> Claim:
    """Compare the part of the weight in K with K, the axis tilted as far as by eye."""
    forearm = Forearm()
    weight_nm = forearm.mass_kg * g * forearm.length_m / 2.0
    stiffness = printed.SEC_34.stiffness_nm_rad
    tilted = 100.0 * weight_nm * math.sin(math.radians(_TILT_DEG)) / stiffness
    return Claim(
        ours=f"the forearm's weight adds at most {number(tilted, 2)} % to K about an axis "
        f"{_TILT_DEG:g}° from the vertical, and {number(100.0 * weight_nm / stiffness, 2)} % about "
        "a horizontal one",
        checks=(bounded(f"Part of the weight in K at {_TILT_DEG:g}°", "%", tilted, high=1.0),),
        figures=(
            Figure(
                "fig-1",
                "Fig. 1, drawn from the text for this software: the rig from above. Not to scale.",
                "The rig from above: actuator below the elbow, torque sensor, splint, stops.",
                draw_rig,
            ),
        ),
    )


def figure_2(context: Context) -> Claim:
    """Compare the stepped controller under a sinusoidal torque with its transfer function."""
    controller, rate_hz = context.settings.controller, context.settings.rig.tick_rate_hz
    J, B = controller.inertia_kg_m2, controller.damping_nm_s_rad
    low_pass = butterworth_lowpass(controller.torque_cutoff_hz, rate_hz)
    step = admittance(J, B, 1.0 / rate_hz)
    phase = 2.0 * math.pi * _SINE_HZ * np.arange(round(_CYCLES * rate_hz / _SINE_HZ)) / rate_hz
    state, velocity, sent = BiquadState(), 0.0, []
    for torque_nm in np.sin(phase).tolist():
        state, passed = biquad_step(low_pass, state, torque_nm)
        velocity = admittance_step(step, velocity, 0.0, passed)
        sent.append(velocity)
    last = slice(len(sent) // 2, None)
    found = 2.0 * float(abs(np.mean(np.array(sent)[last] * np.exp(-1j * phase[last]))))
    s, corner = 2j * math.pi * _SINE_HZ, 2.0 * math.pi * controller.torque_cutoff_hz
    wanted = abs(1.0 / (J * s + B) / ((s / corner) ** 2 + math.sqrt(2.0) * s / corner + 1.0))
    return Claim(
        ours=f"|command/M_meas| at {_SINE_HZ:g} Hz {number(found)} rad/s per N·m stepped through "
        f"time, {number(wanted)} from the diagram",
        checks=(within_percent("|command/M_meas| at 1 Hz", "rad/(s·N·m)", wanted, found, 0.5),),
        figures=(
            Figure(
                "fig-2",
                "Fig. 2, drawn for this software: the loop with the guard, which the paper does "
                "not show.",
                "Block diagram: perturbation and torque, admittance, guard, drive, arm, sensor.",
                draw_loop,
            ),
            Figure(
                "fig-2b",
                "Fig. 2(b), drawn for this software: the two bodies that Eq. 5 cuts apart at the "
                "torque sensor, one of them in software. Counter-clockwise is positive.",
                "Free-body diagram: the controller's inertia under M_PRBS, M_meas and its damping; "
                "arm and robot under M_meas, M_sub, damping and stiffness.",
                draw_free_bodies,
            ),
        ),
    )


def draw_rig() -> Drawing:
    """Draw the rig from above."""
    with styled():
        figure = Drawing(figsize=(7.0, 3.6))
        axes = _canvas(figure, (-6.2, 8.2), (-3.4, 4.0))
        axes.add_patch(FancyBboxPatch((-5.4, -0.7), 5.0, 1.4, boxstyle="round,pad=0.1", fc=_SUBJECT,
                                      ec=_LINE))  # fmt: skip
        turn = math.radians(20.0)
        along = np.array([math.cos(turn), math.sin(turn)])
        across = np.array([-math.sin(turn), math.cos(turn)])

        def bar(start: float, end: float, half: float, colour: str) -> None:
            corners = [start * along - half * across, end * along - half * across,
                       end * along + half * across, start * along + half * across]  # fmt: skip
            axes.add_patch(Polygon(corners, closed=True, fc=colour, ec=_LINE))

        bar(0.0, 5.6, 0.75, _ARM)
        bar(0.3, 6.4, 0.5, _SUBJECT)
        axes.add_patch(Circle((0.0, 0.0), 1.0, fc="#E8E8E8", ec=_LINE))
        axes.add_patch(Circle((0.0, 0.0), 0.55, fc="white", ec=_LINE, hatch="///"))
        axes.add_patch(Circle((0.0, 0.0), 0.08, fc=_LINE, ec=_LINE))
        axes.plot([0.0, 7.4], [0.0, 0.0], color=GREY, linestyle="--", linewidth=0.9)
        axes.add_patch(Arc((0.0, 0.0), 13.6, 13.6, theta1=0.0, theta2=20.0, ec=_LINE))
        axes.annotate(
            "",
            xy=(6.8 * along[0], 6.8 * along[1]),
            xytext=(6.79, 0.45),
            arrowprops={"arrowstyle": "->"},
        )
        axes.text(7.0, 1.1, "θ, M > 0", va="center")
        for angle_deg in (35.0, -35.0):
            stop = 4.6 * np.array([math.cos(math.radians(angle_deg)),
                                   math.sin(math.radians(angle_deg))])  # fmt: skip
            axes.add_patch(Circle(tuple(stop), 0.22, fc="#8A3B00", ec=_LINE))
        _label(axes, "upper arm, at rest on a support", (-4.2, 0.8), (-4.4, 2.4))
        _label(axes, "forearm", (4.8, 1.9), (2.0, 3.4))
        _label(axes, "splint on the robot's arm", (2.6, 0.25), (0.6, -2.9))
        _label(axes, "torque sensor", (-0.25, -0.35), (-3.4, -2.9))
        _label(axes, "actuator, axis vertical\nthrough the elbow", (-0.75, 0.6), (-2.2, 3.2))
        _label(axes, "mechanical stops", (3.9, -2.6), (5.6, -3.0))
    return figure


def draw_loop() -> Drawing:
    """Draw the block diagram of the loop."""
    with styled():
        figure = Drawing(figsize=(7.4, 2.9))
        axes = _canvas(figure, (-0.6, 14.6), (-0.4, 5.6))
        axes.add_patch(Circle((1.9, 4.0), 0.3, fc="white", ec=_LINE))
        blocks = (
            ((3.0, 3.4), 2.2, "admittance\n1/(J_c s + B_c)"),
            ((6.1, 3.4), 1.6, "guard"),
            ((8.6, 3.4), 1.6, "drive"),
            ((11.2, 3.4), 2.2, "arm\nJθ″ + Bθ′ + Kθ"),
            ((8.4, 0.4), 2.0, "torque\nsensor"),
            ((3.0, 0.4), 2.2, "low-pass\n20 Hz"),
        )
        for (left, bottom), width, text in blocks:
            axes.add_patch(Rectangle((left, bottom), width, 1.2, fc=_ARM, ec=_LINE))
            axes.text(left + width / 2, bottom + 0.6, text, ha="center", va="center", fontsize=8)
        for path in (
            [(0.2, 4.0), (1.6, 4.0)],
            [(2.2, 4.0), (3.0, 4.0)],
            [(5.2, 4.0), (6.1, 4.0)],
            [(7.7, 4.0), (8.6, 4.0)],
            [(10.2, 4.0), (11.2, 4.0)],
            [(12.3, 5.4), (12.3, 4.6)],
            [(12.3, 3.4), (12.3, 1.0), (10.4, 1.0)],
            [(8.4, 1.0), (5.2, 1.0)],
            [(3.0, 1.0), (1.9, 1.0), (1.9, 3.7)],
        ):
            x, y = zip(*path, strict=True)
            axes.plot(x[:-1], y[:-1], color=_LINE, linewidth=1.0)
            axes.annotate("", xy=path[-1], xytext=path[-2],
                          arrowprops={"arrowstyle": "-|>", "color": _LINE, "shrinkA": 0,
                                      "shrinkB": 0})  # fmt: skip
        for (at_x, at_y), text in (
            ((0.6, 4.15), "M_PRBS"),
            ((1.4, 4.15), "+"),
            ((2.15, 3.25), "−"),
            ((5.65, 4.75), "θ′ command"),
            ((8.15, 4.15), "sent"),
            ((10.7, 4.15), "θ′"),
            ((12.95, 5.2), "M_sub"),
            ((11.4, 1.15), "M"),
            ((6.8, 1.15), "M_meas"),
        ):
            axes.text(at_x, at_y, text, ha="center", va="bottom", fontsize=8)
    return figure


def draw_free_bodies() -> Drawing:
    """Draw the torques on the controller's body and on that of arm and robot, as in Eq. 5."""
    with styled():
        figure = Drawing(figsize=(7.4, 3.4))
        axes = _canvas(figure, (-0.5, 14.5), (-1.5, 5.4))
        for x, title, body, forward, backward, balance in (
            (3.2, "admittance controller, in software", "J_c", ["M_PRBS"],
             ["B_c θ′", "M_meas"], "J_c θ″ = M_PRBS − M_meas − B_c θ′"),
            (10.8, "arm with the robot's arm", "J_p", ["M_meas", "M_sub"],
             ["B_p θ′", "K_p θ"], "J_p θ″ = M_meas + M_sub − B_p θ′ − K_p θ"),
        ):  # fmt: skip
            axes.add_patch(Circle((x, 2.0), 1.0, fc=_ARM, ec=_LINE))
            axes.plot(x, 2.0, "o", color=_LINE, markersize=3)
            axes.text(x, 2.3, body, ha="center", va="bottom", fontsize=9)
            axes.text(x, 4.8, title, ha="center", va="center", fontsize=9)
            axes.text(x, -1.0, balance, ha="center", va="center", fontsize=9)
            # Those that drive it at its left, those that oppose the motion at its right.
            for k, text in enumerate(forward):
                _turn(axes, (x, 2.0), 1.4 + 0.5 * k, (137.0, 240.0), text, "#0072B2")
            for k, text in enumerate(backward):
                _turn(axes, (x, 2.0), 1.4 + 0.5 * k, (43.0, -60.0), text, "#D55E00")
        axes.annotate("", xy=(7.9, 2.0), xytext=(6.1, 2.0),
                      arrowprops={"arrowstyle": "<->", "color": GREY})  # fmt: skip
        axes.text(7.0, 2.2, "same θ", ha="center", va="bottom", fontsize=8)
    return figure


def _turn(
    axes: Axes,
    centre: tuple[float, float],
    radius: float,
    degrees: tuple[float, float],
    text: str,
    colour: str,
) -> None:
    """Draw a torque as an arrow about a centre from one angle to another, with its name."""
    angle = np.radians(np.linspace(*degrees, 60))
    x, y = centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)
    axes.plot(x[:-1], y[:-1], color=colour, linewidth=1.6)
    axes.annotate("", xy=(x[-1], y[-1]), xytext=(x[-3], y[-3]),
                  arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 0,
                              "shrinkB": 0})  # fmt: skip
    inward = "left" if x[0] < centre[0] else "right"
    axes.text(x[0], y[0] + 0.1, text, color=colour, ha=inward, va="bottom", fontsize=8)


def _canvas(figure: Drawing, x: tuple[float, float], y: tuple[float, float]) -> Axes:
    axes = figure.add_subplot()
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(x)
    axes.set_ylim(y)
    return axes


def _label(axes: Axes, text: str, point: tuple[float, float], place: tuple[float, float]) -> None:
    axes.annotate(text, xy=point, xytext=place, ha="center", va="center", fontsize=8,
                  arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.8})  # fmt: skip
