"""`plot` of the results: Axes in, Axes out, every epoch a point, and no trace in matplotlib."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from tests.unit.analysis.report.cohorts import Design, made_study

import rigidimeter as rm
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.report import Shown
from rigidimeter.analysis.study import StudyResult
from rigidimeter.core.records import Analysis, Epoch, Fit, Outcome
from rigidimeter.core.settings import Settings
from rigidimeter.planning import design

UNIT = {"J": "(10⁻³ kg·m²)", "B": "(N·m·s/rad)", "K": "(N·m/rad)"}


@pytest.fixture(autouse=True)
def _no_trace() -> Iterator[None]:
    """Hold the global state of matplotlib against what it was; close what notebooks would show."""
    plt.close("all")  # what a notebook or an example of the documents has left
    before = dict(mpl.rcParams)
    yield
    plt.close("all")
    assert dict(mpl.rcParams) == before


@pytest.fixture
def recording(epochs: list[Epoch]) -> Recording:
    return Recording(tuple(epochs), (), Settings(), (Path("off.csv"), Path("dbs.csv")))


@pytest.fixture(scope="module")
def result(study: Shown) -> StudyResult:
    return study.result


@pytest.fixture(scope="module")
def cohort() -> StudyResult:
    return made_study(Design(days=(3, 2), epochs=(4, 4), scores=(3, 3))).result


def marked(axes: Axes, markers: str = "osD^v") -> list[tuple[float, float]]:
    """Return the points that are drawn, from left to right; not the entries of the legend."""
    lines = [line for line in axes.lines if line.get_marker() in markers]
    return sorted((float(x), float(y)) for line in lines for x, y in line.get_xydata())


def plots(
    recording: Recording, result: StudyResult, cohort: StudyResult
) -> dict[str, Callable[[Any], Any]]:
    analysis = result.study.analysis
    planned = design(prbs={"duration_s": 8.0})
    return {
        "recording": lambda axes: recording.plot(axes=axes),
        "estimates": lambda axes: analysis.plot(axes=axes),
        "torque": lambda axes: analysis.plot_torque(recording, 1, axes=axes),
        "fit": lambda axes: analysis.fits[1].plot(axes=axes),
        "result": lambda axes: result.plot(axes=axes),
        "days": lambda axes: cohort.plot_days(axes=axes),
        "effects": lambda axes: cohort.plot_effects(axes=axes),
        "design": lambda axes: planned.plot(axes=axes),
    }


def test_all_draw_on_a_figure_of_pyplot_or_on_the_axes_that_they_are_given(
    recording: Recording, result: StudyResult, cohort: StudyResult
) -> None:
    for name, plot in plots(recording, result, cohort).items():
        own = np.ravel(plot(None))
        assert all(isinstance(axes, Axes) for axes in own), name
        assert plt.get_fignums() == [own[0].figure.number], name
        plt.close("all")
        figure = mpl.figure.Figure(figsize=(8, 8))
        given = figure.subplots(own.size, 1)
        drawn = plot(given)
        assert list(np.ravel(drawn)) == list(np.ravel(given)), name
        assert not plt.get_fignums(), name
        if own.size > 1:
            with pytest.raises(ValueError, match=f"this draws {own.size} panels; got 1 Axes"):
                plot(given[0])
        for axes, alike in zip(own, np.ravel(given), strict=True):
            assert axes.get_ylabel() == alike.get_ylabel(), name
            assert len(axes.lines) == len(alike.lines), name


def test_the_front_door_draws_what_the_methods_draw(
    result: StudyResult, cohort: StudyResult
) -> None:
    labels = [ax.get_ylabel() for ax in rm.plot(result)]
    assert labels == [ax.get_ylabel() for ax in result.plot()]
    days = rm.plot(cohort, "days", measure="damping_nm_s_rad")
    assert marked(days) == marked(cohort.plot_days("damping_nm_s_rad"))
    with pytest.raises(TypeError, match="plot draws Recording, Fit, Analysis"):
        rm.plot(3)
    with pytest.raises(ValueError, match="what = 'hours': of StudyResult there are '', 'days'"):
        rm.plot(result, "hours")


def test_each_axis_says_what_it_shows_and_in_what_unit(
    recording: Recording, result: StudyResult, cohort: StudyResult
) -> None:
    without = {"Effect size r; above zero: DBS larger than OFF"}  # a share
    without |= {"Epoch, in the order of recording", "Day, in the order of recording", ""}
    for name, plot in plots(recording, result, cohort).items():
        panels = np.ravel(plot(None))
        labels = {axes.get_ylabel() for axes in panels} | {axes.get_xlabel() for axes in panels}
        assert labels != {""}, name
        assert all(label in without or label.endswith(")") for label in labels), labels


def test_every_epoch_is_a_point_with_its_interval(result: StudyResult) -> None:
    fits = result.study.analysis.fits
    assert len(fits) == 10
    panels = result.study.analysis.plot()
    for i, (symbol, axes) in enumerate(zip("JBK", panels, strict=True)):
        factor = 1e3 if symbol == "J" else 1.0
        expected = [(n + 1, factor * fit.value[i]) for n, fit in enumerate(fits)]
        np.testing.assert_allclose(marked(axes), expected)
        assert UNIT[symbol] in axes.get_ylabel()
        bars = [each for each in axes.collections if isinstance(each, LineCollection)]
        ends = np.concatenate([each.get_segments() for each in bars])
        ends = ends[np.argsort(ends[:, 0, 0])]
        known = [fit for fit in fits if np.isfinite(fit.low[i])]
        np.testing.assert_allclose(ends[:, 0, 1], [factor * fit.low[i] for fit in known])
        np.testing.assert_allclose(ends[:, 1, 1], [factor * fit.high[i] for fit in known])
    legend = [text.get_text() for text in panels[0].get_legend().get_texts()]
    assert {"OFF", "DBS", "OFF, does not count"} <= set(legend)


def test_an_epoch_without_an_estimate_is_a_cross(make_analysis) -> None:
    analysis = make_analysis({"OFF": 4}, scores=False)
    lost = Fit("x.csv", "long name", "OFF", "iv", Outcome("failed", "too short"))
    panels = replace(analysis, fits=(*analysis.fits, lost)).plot()
    for axes in panels:
        assert len(marked(axes)) == 4
        assert [x for x, _ in marked(axes, "x")] == [5.0]
    assert panels[-1].get_xticklabels()[-1].get_text() == "long name"


def test_of_sinusoids_alone_impulse_and_work_are_drawn(result: StudyResult) -> None:
    alone = replace(result.study.analysis, fits=(), fixed_inertia=(), pooled=())
    impulse, work = alone.plot()
    assert len(marked(impulse)) == len(marked(work)) == len(alone.scores) == 8
    assert impulse.get_ylabel() == "Angular impulse\n(N·m·s)"
    with pytest.raises(ValueError, match="no epoch was estimated"):
        Analysis("iv", (), (), 1.0, ()).plot()
    assert len(plt.get_fignums()) == 1


def test_hundreds_of_epochs_have_numbers_on_the_axis(make_analysis) -> None:
    panels = make_analysis({"OFF": 150, "DBS": 150}).plot()
    assert len(marked(panels[2])) == 300
    assert len(panels[2].get_xticks()) < 15


def test_a_fit_is_drawn_in_pairs_and_another_one_over_it(result: StudyResult) -> None:
    fit, other = result.study.analysis.fits[1], result.study.analysis.fits[2]
    panels = fit.plot()
    pairs = ((0, 1), (0, 2), (1, 2))
    scale = (1e3, 1.0, 1.0)
    for axes, (i, k) in zip(panels, pairs, strict=True):
        ((x, y),) = marked(axes)
        np.testing.assert_allclose((x, y), (scale[i] * fit.value[i], scale[k] * fit.value[k]))
        ellipse = axes.lines[-1].get_xydata() / np.array([scale[i], scale[k]])
        of_pair = fit.covariance[np.ix_((i, k), (i, k))]
        from_centre = ellipse - fit.value[[i, k]]
        distance = np.einsum("ni,ij,nj->n", from_centre, np.linalg.inv(of_pair), from_centre)
        np.testing.assert_allclose(distance, 5.991)  # 95 % of χ² with 2 degrees of freedom
    other.plot(axes=panels)
    assert [len(marked(axes)) for axes in panels] == [2, 2, 2]
    names = [text.get_text() for text in panels[-1].get_legend().get_texts()]
    assert names == [f"epoch {one.epoch} OFF" for one in (fit, other)]
    assert panels[0].lines[0].get_color() != panels[0].lines[2].get_color()
    held = result.study.analysis.fixed_inertia[1].plot()  # J without an error: no ellipse with it
    assert [len(axes.lines) for axes in held] == [1, 1, 2]
    with pytest.raises(ValueError, match="epoch 2 of x has no J, B and K: too short"):
        Fit("x", "2", "OFF", "iv", Outcome("failed", "too short")).plot()


def test_the_recording_is_drawn_as_recorded(recording: Recording) -> None:
    panels = recording.plot(1, span_s=None)
    channels = recording.epochs[1].channels
    for axes, name in zip(panels, ("perturbation_nm", "torque_nm", "angle_rad"), strict=True):
        values = channels[name].values
        expected = np.degrees(values) if name == "angle_rad" else values
        np.testing.assert_allclose(axes.lines[0].get_ydata(), expected)
    assert panels[0].get_title(loc="left") == "epoch p1 of off.csv, OFF"
    with pytest.raises(IndexError, match="epoch 99: give its place, from 0 to 17"):
        recording.plot(99)


def test_measured_and_modelled_torque_need_the_recording(
    recording: Recording, result: StudyResult
) -> None:
    top, left, *terms = result.study.analysis.plot_torque(recording, 7)
    measured, model = (line.get_ydata() for line in top.lines)
    np.testing.assert_allclose(left.lines[0].get_ydata(), measured - model)
    np.testing.assert_allclose(sum(axes.lines[1].get_ydata() for axes in terms), model)
    assert 100 * (1 - np.var(measured - model) / np.var(measured)) > 95
    assert top.get_title(loc="left") == "Torque of epoch p2 of dbs.csv, DBS"
    other = replace(recording, epochs=recording.epochs[:1])
    with pytest.raises(ValueError, match="the recording has no epoch p1 of /data"):
        result.study.analysis.plot_torque(other, 1)
    with pytest.raises(ValueError, match=r"must be what rigidimeter.read returned, not 'a.csv'"):
        result.study.analysis.plot_torque("a.csv")


def test_every_value_of_a_comparison_is_a_point(result: StudyResult, cohort: StudyResult) -> None:
    for axes, one in zip(result.plot(), result.values, strict=True):
        drawn = sum(line.get_xydata().shape[0] for line in axes.lines if line.get_gid())
        assert drawn == sum(one.n)
        assert one.measure.title in axes.get_ylabel()
    (axes,) = result.plot(["stiffness_nm_rad"])
    assert axes.get_ylabel() == "Stiffness K (N·m/rad)"
    with pytest.raises(ValueError, match="'stiffness' was not compared; compared were inertia"):
        result.plot(["stiffness"])
    days = cohort.plot_days("work_j")
    drawn = sum(line.get_xydata().shape[0] for line in days.lines if line.get_gid())
    assert drawn == sum(cohort.value_test("work_j").n)
    with pytest.raises(ValueError, match="days: they are known of a study folder alone"):
        result.plot_days()
    effects = cohort.plot_effects()
    assert len(marked(effects, "s")) == len(cohort.effects)
    without = tuple(replace(one, remark="too few") for one in cohort.values)
    with pytest.raises(ValueError, match="no measure has an effect size: too few"):
        replace(cohort, values=without, effects={}).plot_effects()


def test_a_condition_in_dollars_is_no_formula(make_analysis) -> None:
    panels = make_analysis({"$5 and $6": 3}).plot()
    panels[0].figure.canvas.draw()
    text = panels[0].get_legend().get_texts()[0]
    assert text.get_text() == "$5 and $6"
    assert not text.get_parse_math()


def test_matplotlib_is_loaded_late_and_a_notebook_shows_every_figure(tmp_path: Path) -> None:
    """Like that of Jupyter: turned interactive as it is loaded, and shows what is made then."""
    (tmp_path / "notebook_like.py").write_text(
        "import matplotlib as mpl\n"
        "from matplotlib.backend_bases import FigureManagerBase\n"
        "from matplotlib.backends.backend_agg import FigureCanvasAgg as FigureCanvas\n"
        "shown = []\n"
        "mpl.interactive(True)\n"
        "mpl.rcParams['figure.dpi'] = 72\n"
        "def show(*, block=None):\n"
        "    pass\n"
        "def new_figure_manager_given_figure(number, figure):\n"
        "    if mpl.is_interactive():\n"
        "        shown.append(number)\n"
        "    return FigureManagerBase(FigureCanvas(figure), number)\n"
        "def new_figure_manager(number, *args, FigureClass, **options):\n"
        "    return new_figure_manager_given_figure(number, FigureClass(*args, **options))\n"
    )
    code = (
        "import os, sys; os.environ['MPLBACKEND'] = 'module://notebook_like'\n"
        "import rigidimeter as rm, rigidimeter.analysis.study\n"
        "planned = rm.design(prbs={'duration_s': 8.0})\n"
        "assert 'matplotlib' not in sys.modules\n"
        "planned.plot(); planned.plot()\n"
        "import matplotlib as mpl, matplotlib.pyplot as plt\n"
        "plt.subplots()\n"
        "import notebook_like\n"
        "print(notebook_like.shown, mpl.get_backend(), mpl.rcParams['figure.dpi'])\n"
    )
    ran = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert ran.stdout == "[1, 2, 3] module://notebook_like 72.0\n"
