"""A drawing inside the page: its texts, its points and their epochs, and the traces of an epoch."""

import base64
import json
import re

import numpy as np
import pytest
from markupsafe import escape

from rigidimeter.analysis.report.epoch_traces import page_traces, traces_json
from rigidimeter.analysis.report.inline_svg import inline_svg
from rigidimeter.analysis.report.points import draw_distribution
from rigidimeter.analysis.report.style import drawn as figure_of
from rigidimeter.analysis.report.style import svg_text
from rigidimeter.analysis.study import StudyResult
from rigidimeter.analysis.study.drawing import MOST_POINTS, POINTS_PER_CYCLE, packed, thinned

NAME = '<b> 0.12345 #0072b2 id="x"'


def drawn(
    values: list[float], marks: list[tuple[str, str]], places: dict[tuple[str, str], int]
) -> str:
    figure = figure_of((3.0, 3.0), draw_distribution, "y (1)", {NAME: values}, {NAME: "#0072B2"})
    document = svg_text(figure)
    return inline_svg(
        document, "a/b", 'A "drawing"', {"epochs-0": marks}, places, "epoch {1} of {0}".format
    )


def test_points_carry_the_names_and_traces_of_their_epochs_in_order() -> None:
    marks = [("s", f"{k} <&>") for k in range(3)]
    text = drawn([1.0, 3.0, 2.0], marks, {("s", "2 <&>"): 7})
    assert re.findall(r"<title>(.*?)</title>", text) == [
        f"epoch {escape(label)} of s" for _, label in marks
    ]
    uses = re.findall(r"<use ([^>]*)><title>", text)
    assert ["data-epoch" in use for use in uses] == [False, False, True]
    assert 'data-epoch="7"' in uses[2]
    # Upwards on the page is downwards in SVG: the order of the points is that of the values.
    heights = [float(re.search(r'y="([\d.]+)"', use)[1]) for use in uses]
    assert heights[0] > heights[2] > heights[1]


def test_points_that_cannot_be_told_apart_get_no_words() -> None:
    assert "<title>" not in drawn([1.0, 2.0], [("s", "0")], {})


def test_text_stays_as_it_is_and_names_and_colours_are_those_of_the_page() -> None:
    text = drawn([1.0, 2.0], [], {})
    words = re.findall(r">([^<>]+)</text>", text)
    assert any("0.12345" in word or "…" in word for word in words)
    assert "var(--dbs,#0072b2)" in text
    assert "xmlns" not in text
    assert text.startswith('<svg role="img" aria-label="A &#34;drawing&#34;"')
    names = re.findall(r'<[^>]* id="([^"]*)"', text)
    assert names
    assert all(name.startswith("a_b-") for name in names)
    assert set(re.findall(r'(?:href="|url\()#([^")]+)', text)) == set(names)


@pytest.mark.parametrize(("rate_hz", "span_s"), [(200.0, 18.0), (60.0, 300.0), (20.0, 5.0)])
def test_thinned_traces_keep_enough_points_for_the_highest_frequency(
    rate_hz: float, span_s: float
) -> None:
    time_s = np.arange(int(rate_hz * span_s) + 1) / rate_hz
    kept, shown_s = thinned(time_s, 10.0)
    shown = time_s[kept]
    assert shown.size <= MOST_POINTS
    assert np.diff(shown)[0] <= max(1 / (POINTS_PER_CYCLE * 10.0), 1 / rate_hz) + 1e-9
    assert (shown_s < time_s[-1]) == (time_s[-1] - shown[-1] > np.diff(shown)[0])


def test_packed_numbers_are_within_half_a_step() -> None:
    values = np.random.default_rng(1).normal(size=400)
    unit, text = packed(values)
    again = unit * np.frombuffer(base64.b64decode(text), "<i2")
    assert np.max(np.abs(again - values)) <= 0.5001 * unit
    assert unit < 1e-4 * np.max(np.abs(values))


def test_every_epoch_with_numbers_has_traces_whose_residual_is_torque_less_model(
    study: StudyResult,
) -> None:
    traces = page_traces(study)
    analysed = study.analysis
    keys = {(one.source, one.epoch) for one in (*analysed.fixed_inertia, *analysed.scores)}
    assert set(traces) == keys
    one = next(trace for trace in traces.values() if "residual" in trace)
    torque, residual = (
        unit * np.frombuffer(base64.b64decode(text), "<i2")
        for unit, text in (one["torque"], one["residual"])
    )
    assert np.std(residual) < 0.2 * np.std(torque)  # the joint obeys Eq. 3
    text = traces_json([{"title": "</script>"}])
    assert "<" not in text
    assert json.loads(text) == [{"title": "</script>"}]
