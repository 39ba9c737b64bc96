"""The Bode plot: the curves of the loop, the margins as bars."""

import numpy as np
import pytest

from rigidimeter.analysis.figures import draw_bode
from rigidimeter.analysis.figures import drawn as figure_of
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import Loop, loop_stability


def drawn(settings: Settings):
    found = loop_stability(settings)
    shown = settings, found.conditions, found.worst
    return found, figure_of((7.4, 5.4), draw_bode, *shown, rows=2, sharex=True)


def test_the_curves_are_those_of_the_open_loop() -> None:
    settings = Settings()
    found, figure = drawn(settings)
    above, below = figure.axes
    curve = next(line for line in above.lines if line.get_label().startswith("OFF:"))
    frequency_hz, decibel = curve.get_data()
    loop = Loop(settings.controller, settings.rig).at_frequency(np.asarray(frequency_hz))
    expected = loop.gain(found.conditions["OFF"].joint.parameters)
    np.testing.assert_allclose(decibel[:-1], 20 * np.log10(np.abs(expected[:-1])))  # 0 at the end
    phase = next(line for line in below.lines if len(line.get_xdata()) > 10)
    np.testing.assert_allclose(phase.get_ydata()[0], np.degrees(np.angle(expected[0])))
    assert [text.get_text() for text in above.get_legend().get_texts()] == [
        "OFF: 28.3 dB, 92 deg",
        "OFF, worst joint: 16.2 dB, 109 deg",
        "DBS: 28.4 dB, 92 deg",
        "DBS, worst joint: 16.3 dB, 107 deg",
    ]


def test_bars_reach_from_the_curve_to_the_line_it_must_not_cross() -> None:
    found, figure = drawn(Settings())
    above, below = figure.axes
    margins = found.conditions["OFF"]
    gain, phase = (
        next(line for line in axes.lines if line.get_marker() == "_") for axes in (above, below)
    )
    assert list(gain.get_xdata()) == [margins.gain_margin_hz] * 2
    assert list(gain.get_ydata()) == pytest.approx([0.0, -margins.gain_margin_db])
    foot, head = phase.get_ydata()
    assert foot == pytest.approx(-180.0, abs=0.1)
    assert head - foot == pytest.approx(margins.phase_margin_deg)


def test_an_unstable_loop_says_so_and_a_loop_that_never_crosses_is_drawn() -> None:
    _, figure = drawn(
        parse_settings({"controller": {"inertia_kg_m2": 0.0008, "damping_nm_s_rad": 0.028}})
    )
    assert figure.axes[0].get_legend().get_texts()[0].get_text() == "OFF: unstable"
    _, figure = drawn(parse_settings({"subject": {"OFF": {"stiffness_nm_rad": 0.0}}}))
    assert "no crossing" in figure.axes[0].get_legend().get_texts()[0].get_text()
