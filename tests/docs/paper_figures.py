"""Draws the figures of paper/paper.md from the recordings of `rm.data`: `make paper-figures`.

These were simulated with fixed seeds, so the figures are the same each time. Printed is what the
text states.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from tests.docs.drawings import BLUE, GREY, ORANGE
from tests.docs.markdown import ROOT
from tests.example_data import JOINTS

import rigidimeter as rm

FOLDER = ROOT / "paper"
TRUTH = np.array([0.0045, *JOINTS["OFF"].values()])
METHODS = {"published": GREY, "bandlimited": ORANGE, "iv": BLUE}
NAMES = ("J", "B", "K")
SETTINGS = {"dpi": 150, "metadata": {"Software": None}}


def methods() -> Figure:
    """Errors of J, B and K of single epochs, by method, relaxed and pushing."""
    figure = Figure(figsize=(6.4, 2.8), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, name in zip(panels, ("elbow", "pushing"), strict=True):
        recording = rm.data(name)
        for shift, (method, colour) in zip((-0.22, 0.0, 0.22), METHODS.items(), strict=True):
            fits = [fit for fit in rm.estimate(recording, method=method).fits
                    if fit.condition == "OFF"]  # fmt: skip
            errors = np.array([100 * (fit.value / TRUTH - 1) for fit in fits])
            print(name, method, np.round(errors.mean(axis=0), 1))
            for column in range(3):
                places = column + shift + np.linspace(-0.05, 0.05, len(fits))
                label = method if column == 0 else None
                axes.plot(places, errors[:, column], "o", ms=4, color=colour, label=label)
        axes.axhline(0, color=GREY, lw=0.8)
        axes.set_xticks(range(3), NAMES)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_title("relaxed", size=10)
    panels[1].set_title("pushing with 0.2 N·m (SD)", size=10)
    panels[0].set_ylabel("error, % of the simulated value")
    panels[0].legend(frameon=False, fontsize=8)
    return figure


def days() -> Figure:
    """Stiffness of each day of the study, OFF and DBS."""
    figure = Figure(figsize=(6.4, 2.8), layout="constrained")
    result = rm.compare(rm.data("study"))
    print(result.statements.concluded)
    result.plot_days(axes=figure.subplots())
    return figure


FIGURES = {"methods": methods, "days": days}

if __name__ == "__main__":
    for name, draw in FIGURES.items():
        draw().savefig(FOLDER / f"{name}.png", **SETTINGS)
