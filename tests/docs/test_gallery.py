"""The scripts of the gallery: each asks a question, runs, checks its numbers and labels axes."""

from __future__ import annotations

import ast
import runpy
import shutil
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure

GALLERY = Path(__file__).parents[2] / "examples" / "gallery"
SCRIPTS = sorted(GALLERY.glob("*.py"))
SLOW = {"with_15_other_packages"}
"""Those that take more than 15 s."""

NEEDS: dict[str, tuple[str, ...]] = {
    "with_15_other_packages": ("lmfit", "mujoco", "plotly", "sippy_unipi"),
    "with_16_matlab": ("octave-cli",),
    "with_17_r": ("Rscript",),
}
"""Packages and programs without which a script has no result; `plotly` is of mujoco[sysid]."""

COUNTS = ("Epoch", "Day")
"""Axes of what has no unit."""

stems = pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)


@stems
def test_a_script_asks_a_question_and_is_short(path: Path) -> None:
    text = path.read_text("utf-8")
    (title, line, *_) = (ast.get_docstring(ast.parse(text)) or "").splitlines()
    assert title.endswith("?")
    assert line == "=" * len(title)
    assert 40 <= len(text.splitlines()) <= (165 if path.stem in SLOW else 120)


@stems
def test_a_script_checks_its_numbers_and_uses_the_front_door(path: Path) -> None:
    tree = ast.parse(path.read_text("utf-8"))
    assert any(isinstance(node, ast.Assert) for node in ast.walk(tree))
    imported = {
        node.module or ""
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rigidimeter")
    }
    assert imported <= {"rigidimeter.paper"}  # it has no other way from Python


def shown(axis: Axis) -> bool:
    """Whether an axis has numbers, which need a unit; names of conditions need none."""
    texts = [text.get_text() for text in axis.get_ticklabels() if text.get_visible()]
    return any(
        any(c.isdigit() for c in text) and text[0] in "0123456789−-$." for text in texts if text
    )


def unlabelled(figure: Figure) -> Iterator[str]:
    """Yield the axes whose numbers have no label with a unit."""
    figure.canvas.draw()
    axes: list[Axes] = [one for one in figure.axes if one.get_visible() and one.axison]
    for place, one in enumerate(axes):
        for axis in (one.xaxis, one.yaxis):
            label = axis.get_label_text()
            if shown(axis) and not ("(" in label or label.startswith(COUNTS)):
                yield f"panel {place}, {axis.axis_name}: {label!r}"


def clipped(figure: Figure) -> bool:
    """Whether something lies beyond the edge of the figure, by more than a line's width."""
    box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    return min(box.x0, box.y0, width - box.x1, height - box.y1) < -0.03


def test_the_site_runs_those_that_need_the_core_alone() -> None:
    assert {path.stem for path in SCRIPTS if not path.name.startswith("plot_")} == {*NEEDS}


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=pytest.mark.slow if path.stem in SLOW else ()) for path in SCRIPTS],
    ids=lambda path: path.stem,
)
def test_a_script_runs_and_its_figures_are_labelled(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in NEEDS.get(path.stem, ()):
        if shutil.which(name) is None and find_spec(name) is None:
            pytest.skip(f"{name} is not installed")
    monkeypatch.setattr(plt, "show", lambda *_, **__: None)
    with mpl.rc_context({"backend": "Agg"}):
        try:
            runpy.run_path(str(path))
            figures = [plt.figure(number) for number in plt.get_fignums()]
            assert figures
            assert [problem for figure in figures for problem in unlabelled(figure)] == []
            assert not any(map(clipped, figures))
        finally:
            plt.close("all")


def test_a_panel_without_a_unit_is_found() -> None:
    figure = Figure()
    axes = figure.subplots(1, 2)
    axes[0].set(xlabel="Time (s)", ylabel="Torque")
    axes[1].plot(["OFF", "DBS"], [1, 2])
    axes[1].set(ylabel="K (N·m/rad)")
    assert [*unlabelled(figure)] == ["panel 0, y: 'Torque'"]
