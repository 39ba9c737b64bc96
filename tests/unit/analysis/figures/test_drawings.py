"""Figures from arrays: complete, labelled, alike each time, and without trace."""

import dataclasses
import re
from typing import Any
from xml.etree import ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidimeter.analysis.estimation import epoch_signals, scoring_cycles
from rigidimeter.analysis.figures import (
    condition_colours,
    draw_bands,
    draw_distribution,
    draw_loops,
    draw_perturbation,
    draw_recorded,
    draw_spectrum,
    draw_torque,
    drawn,
    loop_limits,
    svg_text,
    torque_limit_nm,
)
from rigidimeter.analysis.report import Shown
from rigidimeter.core.records import BandEstimate, Channel

STAMPS = np.arange(5000) / 250
LEVELS = np.where(np.random.default_rng(5).random(400) < 0.5, -1.0, 1.0)
PRBS = Channel("perturbation_nm", STAMPS, np.repeat(LEVELS, 13)[:5000])


SIZE = (7.0, 5.0)


def distribution(*arguments: Any) -> Figure:
    return drawn(SIZE, draw_distribution, *arguments)


def test_every_point_of_a_distribution_is_drawn_at_its_value() -> None:
    values = {"OFF": list(np.linspace(0.1, 0.3, 300)), "DBS": [0.2], "other": []}
    figure = distribution("Damping (N·m·s/rad)", values, condition_colours(values))
    (axes,) = figure.axes
    strips = [line for line in axes.lines if line.get_gid()]
    assert [list(line.get_ydata()) for line in strips] == [values["OFF"], values["DBS"]]
    for position, line in enumerate(strips):
        assert np.all(np.abs(np.asarray(line.get_xdata()) - position) < 0.45)
    assert [text.get_text() for text in axes.get_xticklabels()] == [
        "OFF\nn = 300",
        "DBS\nn = 1",
        "other\nn = 0",
    ]
    assert axes.get_ylabel() == "Damping (N·m·s/rad)"


def test_median_and_quartiles_are_marked() -> None:
    figure = distribution("x (1)", {"OFF": [8.0, 1.0, 4.0, 2.0]}, {"OFF": "black"})
    _, diamond = figure.axes[0].lines
    (quartiles,) = figure.axes[0].collections[0].get_segments()
    assert list(quartiles[:, 1]) == [1.75, 5.0]
    assert list(diamond.get_ydata()) == [3.0]
    assert quartiles[0, 0] == diamond.get_xdata()[0]


def test_intervals_stand_at_their_points_and_the_pooled_estimate_beside_them() -> None:
    nan = float("nan")
    figure = distribution(
        "x (1)",
        {"OFF": [(1.0, 0.5, 1.5), (2.0, nan, 3.0), (4.0, 2.0, 6.0)], "DBS": []},
        {"OFF": "black", "DBS": "red"},
        "",
        {"OFF": (2.2, 1.7, 2.7), "DBS": (5.0, nan, nan)},
    )
    (axes,) = figure.axes
    bars, _, pooled = (lines.get_segments() for lines in axes.collections)
    points = next(line for line in axes.lines if line.get_gid())
    assert [list(bar[:, 1]) for bar in bars] == [[0.5, 1.5], [2.0, 6.0]]
    across = np.asarray(points.get_xdata())[[0, 2]]
    np.testing.assert_allclose([bar[0, 0] for bar in bars], across)
    assert list(pooled[0][:, 1]) == [1.7, 2.7]
    squares = [line for line in axes.lines if line.get_marker() == "s"]
    assert [float(line.get_ydata()[0]) for line in squares] == [2.2, 5.0]
    low, high = axes.get_ylim()
    assert low < 0.5
    assert high > 6.0


def test_other_bands_stand_at_their_change_in_percent_with_its_error() -> None:
    zero, value = (0.0, 0.0, 0.0), (0.004, 0.1, 2.0)
    own = BandEstimate("OFF", 0.1, 30.0, "all", value, zero, zero, (1.0, 1.0, 1.0))
    other = BandEstimate(
        "OFF",
        0.1,
        15.0,
        "all",
        (0.0044, 0.1, 1.9),
        (0.0004, 0.0, -0.1),
        (0.0004, 0.01, 0.2),
        (0.3, 1.0, 0.6),
    )
    half = {"OFF": np.array([5.0, 5.0, 5.0])}
    figure = drawn(SIZE, draw_bands, [own, other], half, columns=3)
    changed = [axes.lines[1].get_xdata()[0] for axes in figure.axes]
    assert changed == pytest.approx([10.0, 0.0, -5.0])
    (bar,) = figure.axes[0].collections[0].get_segments()
    assert bar[:, 0] == pytest.approx([10 - 19.6, 10 + 19.6], abs=0.01)
    assert [text.get_text() for text in figure.axes[0].get_yticklabels()] == ["0.1 to 15 Hz"]


def test_perturbation_shows_its_beginning_and_the_whole() -> None:
    above, below = drawn(SIZE, draw_perturbation, PRBS, -1.0, rows=2).axes
    assert above.get_xlim() == (1.0, 8.0)
    assert below.get_xlim() == (1.0, 1.0 + STAMPS[-1])
    assert below.get_xlabel() == "Time since the start of the epoch (s)"


def test_spectrum_of_a_line_peaks_at_the_line() -> None:
    line = Channel("perturbation_nm", 7.0 + STAMPS, np.sin(2 * np.pi * 3 * STAMPS))
    (axes,) = drawn(SIZE, draw_spectrum, line, (0.15, 10.0)).axes
    frequency_hz, density = (np.asarray(d) for d in axes.lines[0].get_data())
    assert frequency_hz[np.argmax(density)] == pytest.approx(3.0, abs=0.05)
    # The power of a sine of amplitude 1 is ½.
    assert np.sum(density) * np.diff(frequency_hz)[0] == pytest.approx(0.5, rel=0.01)
    assert axes.get_ylabel().endswith("((N·m)²/Hz)")


def test_parts_of_the_model_add_up_to_it(study: Shown) -> None:
    fit = study.analysis.fixed_inertia[1]
    epoch = study.epochs[1]
    signals = epoch_signals(epoch, study.study.settings, fit.method)
    limit_nm = torque_limit_nm(signals, fit)
    figure = drawn(SIZE, draw_torque, signals, fit, "black", 100.0, limit_nm, rows=5)
    torque, left, *parts = figure.axes
    assert len(parts) == 3
    model = np.asarray(torque.lines[1].get_ydata())
    assert np.allclose(sum(np.asarray(axes.lines[1].get_ydata()) for axes in parts), model)
    measured, modelled = torque.lines
    assert measured.get_linewidth() > 2 * modelled.get_linewidth()
    misfit = np.asarray(measured.get_ydata()) - model
    assert np.allclose(np.asarray(left.lines[0].get_ydata()), misfit)
    for axes in parts:
        grey, part = (np.asarray(line.get_ydata()) for line in axes.lines)
        assert np.allclose(grey - part, misfit)
        assert np.max(np.abs(grey)) <= limit_nm
        assert axes.get_ylabel() == "Torque (N·m)"
        assert axes.get_xlim() == pytest.approx((1.0, 8.0), abs=0.02)


def test_what_was_recorded_is_drawn_as_it_was() -> None:
    angle = Channel("angle_rad", STAMPS, np.radians(STAMPS))
    channels = {"perturbation_nm": PRBS, "angle_rad": angle}
    held, turned = drawn(SIZE, draw_recorded, channels, -1.0, rows=2).axes
    assert held.lines[0].get_drawstyle() == "steps-post"
    across, degrees = (np.asarray(d) for d in turned.lines[0].get_data())
    np.testing.assert_allclose(degrees, across - 1.0)
    assert across[-1] >= 7.0
    assert [axes.get_ylabel() for axes in (held, turned)] == ["Perturbation\n(N·m)", "Angle\n(deg)"]


def test_loops_of_the_conditions_share_a_panel_in_degrees(study: Shown) -> None:
    epoch = next(epoch for epoch in study.epochs if epoch.task == "sinusoid")
    cycles = scoring_cycles(epoch, study.study.settings.scores)
    shown = [("OFF: 1 J", cycles, "black"), ("_DBS: 1 J", cycles, "red")]
    figure = drawn(SIZE, draw_loops, shown)
    (axes,) = figure.axes
    assert [line.get_color() for line in axes.lines] == ["black", "red"]
    assert len(figure.legends[0].get_texts()) == 2
    assert np.max(np.asarray(axes.lines[0].get_xdata())) == pytest.approx(20.0, rel=0.05)
    assert axes.get_xlim()[1] == loop_limits([cycles])[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("Angle (deg)", "Torque (N·m)")


def draw() -> Figure:
    return distribution("x (1)", {"OFF": [1.0, 2.0]}, {"OFF": "black"}, "p = 0.04")


def test_svg_needs_nothing_from_elsewhere() -> None:
    root = ET.fromstring(svg_text(draw()))
    for element in root.iter():
        for name, value in element.attrib.items():
            if name.endswith("href"):
                assert value.startswith("#")


def test_the_users_matplotlib_style_is_neither_used_nor_changed() -> None:
    plain = svg_text(draw())
    with mpl.rc_context({"font.size": 30.0, "axes.facecolor": "black", "text.usetex": True}):
        assert svg_text(draw()) == plain
        assert mpl.rcParams["font.size"] == 30.0


@pytest.mark.parametrize(
    "name",
    ["", "$x_$^", "a" * 300, "多巴胺", "<b>&\"'</b>", "line\nbreak", "--", "\udce9", "%s{0}"],
)
def test_any_name_of_a_condition_can_be_drawn(name: str) -> None:
    figure = distribution("x (1)", {name: [1.0]}, condition_colours([name]))
    ET.fromstring(svg_text(figure).encode())


def test_a_condition_keeps_its_colour() -> None:
    both = condition_colours(["OFF", "DBS", "levodopa"])
    assert condition_colours(["levodopa", "DBS"]) == {
        name: both[name] for name in ("levodopa", "DBS")
    }
    assert len(set(both.values())) == 3
    assert len(condition_colours([str(i) for i in range(20)])) == 20


def test_a_constant_sample_is_drawn_without_complaint() -> None:
    svg_text(distribution("x (1)", {"OFF": [0.0] * 5}, {"OFF": "black"}))
    svg_text(distribution("x (1)", {"OFF": [1e-300, 1e300]}, {"OFF": "black"}))


def test_a_channel_on_a_late_clock_is_drawn_from_its_origin() -> None:
    late = dataclasses.replace(PRBS, time_s=1.7e9 + STAMPS)
    above, _ = drawn(SIZE, draw_perturbation, late, 1.7e9, rows=2).axes
    assert above.get_xlim() == (0.0, 7.0)


def tick_texts(*sizes: float, scale: str = "linear") -> list[str]:
    def draw(panels: list[Axes]) -> None:
        panels[0].plot(range(len(sizes)), sizes)
        panels[0].set_yscale(scale)
        panels[0].set_xticks([0], ["one"])

    svg = svg_text(drawn((3.0, 3.0), draw))
    return re.findall(r">([^<>]+)</text>", svg)


def test_ticks_are_written_as_all_numbers_of_the_page_are() -> None:
    assert tick_texts(-0.5, 0.5) == ["one", "−0.4", "−0.2", "0.0", "0.2", "0.4"]
    # No factor or offset stands at the end of the axis.
    assert tick_texts(4.49999, 4.50001)[1:4] == ["4.4999900", "4.4999925", "4.4999950"]
    assert {"0", "0.5·10⁻⁶", "1.0·10⁻⁶"} <= set(tick_texts(0.0, 4e-6))
    assert tick_texts(1e-8, 100.0, scale="log")[1:] == [
        "10⁻⁸",
        "10⁻⁶",
        "10⁻⁴",
        "0.01",
        "1",
        "100",
    ]
