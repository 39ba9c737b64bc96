"""The joint over frequency as it is drawn: every point, the model, and what is left."""

import numpy as np
import pytest
from tests.unit.analysis.report.conftest import OFF

from rigidimeter.analysis.figures import (
    condition_colours,
    draw_impedance,
    draw_unexplained,
    drawn,
    model_nm_rad,
    svg_text,
)
from rigidimeter.analysis.traces import Response, Spectrum
from rigidimeter.model import JointDynamics


def test_the_model_is_eq_3_over_frequency() -> None:
    joint = JointDynamics(0.0045, 0.1368, 1.751)
    resonance_hz = np.sqrt(1.751 / 0.0045) / (2 * np.pi)
    low, there = model_nm_rad(joint, np.array([0.0, resonance_hz]))
    assert low == 1.751
    # K and J cancel where ω² = K/J: only i B ω is left.
    assert there.real == pytest.approx(0.0, abs=1e-12)
    assert there.imag == pytest.approx(0.1368 * np.sqrt(1.751 / 0.0045))


def responses() -> dict[str, Response]:
    frequency_hz = np.array([0.5, 2.0, 8.0])
    off = 1.1 * model_nm_rad(OFF, frequency_hz)
    return {
        "OFF": Response(frequency_hz, off, np.array([0.99, 0.4, 0.8]), 1, 1),
        "DBS": Response(frequency_hz, model_nm_rad(OFF, frequency_hz), np.ones(3), 1, 1),
    }


def impedance(measured: dict[str, Response], joints: dict[str, JointDynamics]):
    return drawn((7.4, 6.4), draw_impedance, measured, condition_colours(measured), joints, rows=3)


def unexplained(name: str, *densities: np.ndarray):
    grid = np.linspace(0, 12, 61)
    spectra = [Spectrum(name, grid, density, 0.1, (0.15, 10.0)) for density in densities]
    return drawn((7.4, 3.0), draw_unexplained, spectra, {name: "red"}, {name: name}, (0.15, 10.0))


def test_every_point_is_drawn_and_those_without_coherence_are_hollow() -> None:
    magnitude, phase, coherence = impedance(responses(), {"OFF": OFF}).axes
    expected = responses()["OFF"]
    sure, unsure = magnitude.lines[:2]
    np.testing.assert_allclose(
        sure.get_ydata(), np.abs(expected.impedance_nm_rad)[expected.coherence >= 0.5]
    )
    np.testing.assert_allclose(unsure.get_xdata(), [2.0])
    assert unsure.get_markerfacecolor() == "none"
    (curve,) = [line for line in magnitude.lines if len(line.get_xdata()) > 100]
    np.testing.assert_allclose(
        curve.get_ydata(), np.abs(model_nm_rad(OFF, np.asarray(curve.get_xdata())))
    )
    assert curve.get_label() == f"OFF, model: K {OFF.stiffness_nm_rad:.2f} N·m/rad"
    assert [axes.get_ylabel() for axes in (magnitude, phase, coherence)] == [
        "Torque over angle\n(N·m/rad)",
        "Phase (deg)",
        "Coherence (1)",
    ]
    assert coherence.get_xlabel() == "Frequency (Hz)"


def test_each_epoch_is_a_line_of_the_spectrum_and_the_mean_is_thick() -> None:
    (axes,) = unexplained("OFF", np.full(61, 1e-3), np.full(61, 3e-3)).axes
    one, two, mean = axes.lines
    np.testing.assert_allclose(mean.get_ydata(), 2e-3)
    assert mean.get_linewidth() > 2 * max(one.get_linewidth(), two.get_linewidth())
    assert axes.get_ylabel().endswith("((N·m)²/Hz)")


@pytest.mark.parametrize("name", ["_x", "$1^_$", "多巴胺", "<b>"])
def test_any_condition_is_in_the_legends(name: str) -> None:
    # A joint that explains all of the torque leaves nothing to draw but the foot of the axes.
    below = unexplained(name, np.zeros(61))
    over = impedance({name: responses()["OFF"]}, {name: OFF})
    for figure, entries in ((below, 1), (over, 2)):
        svg_text(figure)
        legend = figure.axes[0].get_legend() or figure.legends[0]
        assert len(legend.get_texts()) == entries


def test_the_plateau_can_be_read_off() -> None:
    figure = impedance(responses(), {"OFF": OFF})
    svg_text(figure)
    axes = figure.axes[0]
    low, high = axes.get_ylim()
    ticks = [t for t in axes.get_yticks() if low <= t <= high]
    near = [t for t in ticks if 0.6 < t / OFF.stiffness_nm_rad < 1.7]
    assert len(near) >= 2
    assert {f"{t:g}" for t in near} <= {text.get_text() for text in axes.get_yticklabels()}
