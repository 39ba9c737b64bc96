"""The joint over frequency: lines may be added only once turned, and then they are the joint's."""

import dataclasses

import numpy as np
import pytest
from rigidimeter.analysis.report.curves import (
    COHERENT,
    draw_impedance,
    draw_unexplained,
    model_nm_rad,
)
from rigidimeter.analysis.report.style import condition_colours, drawn, svg_text

from rigidimeter.analysis.estimation import impedance as without_model
from rigidimeter.analysis.estimation import prepare
from rigidimeter.analysis.report import SECTIONS, Figure
from rigidimeter.analysis.study import StudyResult
from rigidimeter.analysis.study.drawn_signals import Response, Spectrum
from rigidimeter.analysis.study.examples import analysed_epoch
from rigidimeter.core.records import Channel, Delay, Outcome
from rigidimeter.core.settings import Settings
from rigidimeter.model import JointDynamics

from .conftest import OFF, periodic_epoch


def figures(result: StudyResult, name: str) -> list[Figure]:
    (section,) = [section for section in SECTIONS if section.name == name]
    return [block for block in section.blocks(result) if isinstance(block, Figure)]


def impedance_figures(result: StudyResult) -> list[Figure]:
    return figures(result, "impedance")


def voluntary_figures(result: StudyResult) -> list[Figure]:
    return figures(result, "voluntary")


def begun_elsewhere():
    """Return epochs without noise that begin at three places of the sequence."""
    rng = np.random.default_rng(2)
    return [periodic_epoch(OFF, str(i), "OFF", rng, 21 * i, noise_nm=0.0) for i in range(3)]


def measured(epochs):
    return without_model(prepare(epochs, Settings(), clocks=False).perturbed)


def test_the_model_is_eq_3_over_frequency() -> None:
    joint = JointDynamics(0.0045, 0.1368, 1.751)
    resonance_hz = np.sqrt(1.751 / 0.0045) / (2 * np.pi)
    low, there = model_nm_rad(joint, np.array([0.0, resonance_hz]))
    assert low == 1.751
    # K and J cancel where ω² = K/J: only i B ω is left.
    assert there.real == pytest.approx(0.0, abs=1e-12)
    assert there.imag == pytest.approx(0.1368 * np.sqrt(1.751 / 0.0045))


def test_lines_of_epochs_that_began_elsewhere_add_up_to_the_joint() -> None:
    found = measured(begun_elsewhere())
    assert found is not None
    assert found.observed == 3
    low = found.frequency_hz < 5.0
    expected = model_nm_rad(OFF, found.frequency_hz)
    error = np.abs(found.impedance_nm_rad / expected - 1)[low]
    # The window, which rises and falls within 1 s of 19, mixes the lines by a few percent; lines
    # that were not turned are wrong by up to 90 %.
    assert np.median(error) < 0.05
    assert np.max(error) < 0.12
    assert np.min(found.coherence[low]) > 0.95


def test_only_epochs_with_the_same_lines_are_added() -> None:
    shorter = periodic_epoch(OFF, "s", "OFF", np.random.default_rng(0))
    two, one = (
        dataclasses.replace(
            shorter,
            channels={
                name: Channel(name, channel.time_s[:n], channel.values[:n])
                for name, channel in shorter.channels.items()
            },
        )
        for n in (4000, 2000)
    )
    whole = begun_elsewhere()
    together = measured([two, *whole])
    assert together is not None
    assert together.observed == 4  # two periods have the lines of three
    left = measured([one, *whole])
    assert left is not None
    assert left.observed == 3
    assert measured([one]) is None


def responses() -> dict[str, Response]:
    frequency_hz = np.array([0.5, 2.0, 8.0])
    off = 1.1 * model_nm_rad(OFF, frequency_hz)
    return {
        "OFF": Response(frequency_hz, off, np.array([0.99, 0.4, 0.8]), 1, 1),
        "DBS": Response(frequency_hz, model_nm_rad(OFF, frequency_hz), np.ones(3), 1, 1),
    }


JOINTS = {"OFF": OFF}


def impedance(measured: dict[str, Response], joints: dict[str, JointDynamics]):
    return drawn((7.4, 6.4), draw_impedance, measured, condition_colours(measured), joints, rows=3)


def unexplained(name: str, *densities: np.ndarray):
    grid = np.linspace(0, 12, 61)
    spectra = [Spectrum(name, grid, density, 0.1, (0.15, 10.0)) for density in densities]
    return drawn((7.4, 3.0), draw_unexplained, spectra, {name: "red"}, {name: name}, (0.15, 10.0))


def test_every_point_is_drawn_and_those_without_coherence_are_hollow() -> None:
    magnitude, phase, coherence = impedance(responses(), JOINTS).axes
    expected = responses()["OFF"]
    sure, unsure = magnitude.lines[:2]
    np.testing.assert_allclose(
        sure.get_ydata(), np.abs(expected.impedance_nm_rad)[expected.coherence >= COHERENT]
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


def test_the_figure_is_made_of_epochs_that_repeat(
    periodic_study: StudyResult, study: StudyResult
) -> None:
    (figure,) = impedance_figures(periodic_study)
    assert "OFF: 2 of 2 included epochs; DBS: 2 of 2 included epochs" in figure.caption
    (again,) = impedance_figures(periodic_study)
    assert svg_text(figure.draw()) == svg_text(again.draw())
    assert impedance_figures(study) == []  # random levels do not repeat


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
    figure = impedance(responses(), JOINTS)
    svg_text(figure)
    axes = figure.axes[0]
    low, high = axes.get_ylim()
    ticks = [t for t in axes.get_yticks() if low <= t <= high]
    near = [t for t in ticks if 0.6 < t / OFF.stiffness_nm_rad < 1.7]
    assert len(near) >= 2
    assert {f"{t:g}" for t in near} <= {text.get_text() for text in axes.get_yticklabels()}


def test_the_sd_that_the_spectrum_quotes_is_that_of_the_noise(periodic_study: StudyResult) -> None:
    (figure,) = voluntary_figures(periodic_study)
    # White noise of 0.01 N·m at 250 samples/s in the band up to 10 Hz.
    expected = 0.01 * np.sqrt(2 * (10 - 0.15) / 250)
    quoted = float(figure.alt.split("OFF: SD ")[1].split(" N·m")[0])
    assert quoted == pytest.approx(expected, rel=0.15)


def test_what_does_not_count_is_not_drawn(make_study, make_analysis) -> None:
    excluded = make_study([], analysis=make_analysis({"OFF": 2}, Outcome("excluded", "no")))
    assert voluntary_figures(excluded) == impedance_figures(excluded) == []


def test_figures_show_the_epoch_on_the_clock_it_was_analysed_on(
    study: StudyResult, make_study, make_analysis
) -> None:
    epoch = study.epochs[1]
    analysis = make_analysis({"OFF": 1})
    late = Delay(epoch.source, 0.012, 0.001, corrected=True)
    made = make_study([epoch], analysis=dataclasses.replace(analysis, delays=(late,)))
    result = dataclasses.replace(analysis.fits[0], source=epoch.source, epoch=epoch.label)
    moved = analysed_epoch(made, result)
    assert moved is not None
    np.testing.assert_allclose(
        moved.channels["torque_nm"].time_s, epoch.channels["torque_nm"].time_s - 0.012
    )
    assert moved.channels["angle_rad"] is epoch.channels["angle_rad"]
