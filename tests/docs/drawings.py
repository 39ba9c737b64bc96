"""Draws the figures of the explanations, and those of the maintainers' measured tables.

    python -m tests.docs.drawings

Words stay words in them, so that a test compares these. A width of 3.7 inches fills a telephone.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch
from tests.docs import measured_figures
from tests.docs.markdown import ROOT

FOLDER = ROOT / "docs" / "images"
WIDTH_IN = 3.7
BLUE, ORANGE, GREY, PALE = "#1f5fa8", "#c2570c", "#555555", "#eef3f9"
NO_DATE = {"Date": None, "Creator": None}


def which_method() -> Figure:
    """Three questions, each with its answers."""
    figure, axes = _blank(height_in=7.5)
    y = 0.0
    for question, answers in QUESTIONS:
        axes.text(0, y, question, weight="bold", va="top", size=10)
        y -= 0.36
        for condition, answer in answers:
            lines = answer.count("\n") + 1
            height = 0.165 * (lines + 1) + 0.13
            _box(axes, 0.0, y - height, WIDTH_IN - 0.2, height)
            axes.text(0.1, y - 0.08, condition, va="top", color=GREY)
            axes.text(0.1, y - 0.25, answer, va="top", color=BLUE, linespacing=1.25)
            y -= height + 0.09
        y -= 0.12
    axes.set_ylim(y + 0.1, 0.05)
    return figure


QUESTIONS = (
    (
        "1  Was the perturbation recorded?",
        (
            ("yes", "iv, the default"),
            ("yes, two periods or more, no missed tick", "iv; spectral as a second opinion"),
            ("no, but the velocity command", "bandlimited; J is right as well"),
            (
                "torque and motion alone",
                "bandlimited; J may be low,\n0.8 to 14 % at 1000 samples/s",
            ),
        ),
    ),
    (
        "2  Does the subject push?",
        (
            ("no", "read lack_of_fit, missing_term"),
            (
                "yes, perturbation recorded",
                "iv is not biased by it; pool epochs.\nA reflex is named: J, B, K are beside it",
            ),
            ("yes, not recorded", "read loop_bias, unweighted_fit;\nboth silent: use bandlimited"),
            ("yes, EMG recorded", "active stretches are left out"),
        ),
    ),
    (
        "3  How many days?",
        (
            ("1 or 2 in each condition", "the difference measured, no more"),
            (
                "3 or more, both conditions each day",
                "paired t-test of days; K 18 % lower is\nfound in 20, 60, 93 % (3, 5, 8 days)",
            ),
            ("conditions on different days", "Welch's t-test of days, alternated"),
            ("3 or more subjects", "t-test of subjects"),
        ),
    ),
)


def loop() -> Figure:
    """The closed loop: what the subject does is in torque and in motion."""
    figure, axes = _blank(height_in=2.0)
    boxes = {
        "controller\n1/(J_c s + B_c)": (0.75, 1.15, 1.15),
        "drive": (2.2, 1.15, 0.55),
        "joint\nJ, B, K": (2.95, 1.15, 0.6),
    }
    for text, (x, y, width) in boxes.items():
        _box(axes, x, y, width, 0.5)
        axes.text(x + width / 2, y + 0.25, text, ha="center", va="center")
    arrow = partial(axes.annotate, "", arrowprops={"arrowstyle": "->", "color": GREY})
    for start, end in (((0.05, 1.4), (0.43, 1.4)), ((0.57, 1.4), (0.75, 1.4)),
                       ((1.9, 1.4), (2.2, 1.4)), ((2.75, 1.4), (2.95, 1.4)),
                       ((0.5, 0.45), (0.5, 1.33)), ((3.3, 2.0), (3.3, 1.65))):  # fmt: skip
        arrow(xy=end, xytext=start)
    axes.plot([3.3, 3.3, 0.5], [1.15, 0.45, 0.45], color=GREY, lw=1)
    axes.plot(0.5, 1.4, "o", ms=10, mfc="white", mec=GREY)
    axes.text(0.0, 1.5, "M_PRBS", color=BLUE, va="bottom")
    axes.text(0.37, 1.17, "−", va="center")
    axes.text(2.05, 1.5, "c", va="bottom", ha="center")
    axes.text(2.87, 1.5, "θ′", va="bottom", ha="center")
    axes.text(3.22, 1.92, "M_sub", color=ORANGE, ha="right")
    axes.text(1.9, 0.4, "M = J θ″ + B θ′ + K θ − M_sub", ha="center", va="top")
    axes.set_ylim(0.1, 2.1)
    return figure


def between() -> Figure:
    """What a torque sampled at the ticks sees of the acceleration."""
    with mpl.rc_context({"axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(WIDTH_IN, 3.3), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True)
    tick_s, rate = 0.005, 2 * np.pi * 50
    commands = np.array([0.0, 1.0, 1.6, 1.2])
    fine, velocity = np.linspace(0, tick_s, 60), 0.0
    for number, command in enumerate(commands):
        moved = command + (velocity - command) * np.exp(-rate * fine)
        time_ms = 1e3 * (number * tick_s + fine)
        above.plot(time_ms, moved, color=BLUE, label="" if number else "velocity")
        above.hlines(
            command, time_ms[0], time_ms[-1], color=GREY, label="" if number else "command"
        )
        acceleration = rate * (command - moved)
        below.plot(time_ms, acceleration, color=BLUE)
        mean = (moved[-1] - velocity) / tick_s
        below.hlines(mean, time_ms[0], time_ms[-1], color=GREY, ls="--",
                     label="" if number else "from samples of the velocity")  # fmt: skip
        below.plot(time_ms[-1], acceleration[-1], "o", color=ORANGE,
                   label="" if number else "where the torque is sampled")  # fmt: skip
        velocity = moved[-1]
    below.set_ylim(top=500)
    above.set_ylabel("rad/s")
    below.set_ylabel("acceleration, rad/s²")
    below.set_xlabel("time, ms")
    above.legend(frameon=False, fontsize=8)
    below.legend(frameon=False, fontsize=8)
    return figure


DESIGNS = {
    "8 days with both, alike": "8 days, both conditions;\na day moves both",
    "8 days with both, each by itself": "8 days, both conditions;\na day moves each by itself",
    "8 days each, none shared": "8 days each, none shared",
    "9 days, 4 with both, both": "9 days, 4 with both",
}


def day_tests() -> Figure:
    """False positives of two tests, from the table that the benchmark prints."""
    page = (ROOT / "docs" / "development" / "day-tests.md").read_text("utf-8")
    rows = {}
    for line in re.findall(r"^\| .* / .* \|$", page, re.M):
        name, *cells = [cell.strip() for cell in line.strip("|").split("|")]
        rows[name] = [float(cell.split("/")[0]) for cell in cells]
    figure = Figure(figsize=(WIDTH_IN, 2.4), layout="constrained")
    axes = figure.subplots()
    places = np.arange(len(DESIGNS))[::-1]
    for column, (label, colour) in {0: ("epochs", ORANGE), 3: ("days", BLUE)}.items():
        found = [rows[name][column] for name in DESIGNS]
        axes.plot(found, places, "o", color=colour, label=f"test by {label}")
    axes.axvline(5, color=GREY, lw=1)
    axes.set_yticks(places, DESIGNS.values(), size=8)
    axes.set_xlim(0, 36)
    axes.set_xlabel("false positives, % (5 is right)")
    axes.set_ylim(-0.4, 3.9)
    axes.legend(frameon=False, fontsize=8, loc="upper right")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _blank(height_in: float) -> tuple[Figure, Axes]:
    """Return axes in inches without lines."""
    figure = Figure(figsize=(WIDTH_IN, height_in))
    axes = figure.add_axes((0.02, 0.01, 0.96, 0.98))
    axes.set_xlim(-0.05, WIDTH_IN - 0.1)
    axes.axis("off")
    return figure, axes


def _box(axes: Axes, x: float, y: float, width: float, height: float) -> None:
    axes.add_patch(
        FancyBboxPatch(
            (x, y),
            width,
            height,
            "round,pad=0,rounding_size=0.06",
            facecolor=PALE,
            edgecolor=GREY,
            linewidth=0.7,
        )
    )


DRAWINGS: Mapping[str, Callable[[], Figure]] = {
    "which-method": which_method,
    "loop": loop,
    "between-samples": between,
    "day-tests": day_tests,
}
FILES: Mapping[Path, Callable[[], Figure]] = {
    folder / f"{name}.svg": figure
    for folder, figures in (
        (FOLDER, DRAWINGS),
        (measured_figures.FOLDER, measured_figures.FIGURES),
    )
    for name, figure in figures.items()
}


def draw(path: Path, figure: Callable[[], Figure]) -> None:
    """Write a figure, the same each time."""
    style = {"svg.fonttype": "none", "svg.hashsalt": "rigidimeter", "font.size": 9}
    with mpl.rc_context(style):  # type: ignore[arg-type]
        figure().savefig(path, format="svg", metadata=NO_DATE, facecolor="white")


def main() -> None:
    """Draw all."""
    for path, figure in FILES.items():
        draw(path, figure)


if __name__ == "__main__":
    main()
