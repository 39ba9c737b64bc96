"""The joint over frequency: lines may be added only once turned, and then they are the joint's."""

import dataclasses

import numpy as np
import pytest
from tests.unit.analysis.report.conftest import OFF, periodic_epoch

from rigidimeter.analysis.estimation import impedance, prepare
from rigidimeter.analysis.figures import model_nm_rad
from rigidimeter.analysis.report import Shown
from rigidimeter.analysis.traces import Response, responses, unexplained_spectra
from rigidimeter.core.records import Channel, Outcome
from rigidimeter.core.settings import Settings


def begun_elsewhere():
    """Return epochs without noise that begin at three places of the sequence."""
    rng = np.random.default_rng(2)
    return [periodic_epoch(OFF, str(i), "OFF", rng, 21 * i, noise_nm=0.0) for i in range(3)]


def measured(epochs):
    return impedance(prepare(epochs, Settings(), clocks=False).perturbed)


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


def responses_of(shown: Shown) -> dict[str, Response]:
    return responses(shown.analysis, shown.condition_names, shown.as_analysed)


def test_the_conditions_of_epochs_that_repeat_have_a_response(
    periodic_study: Shown, study: Shown
) -> None:
    found = responses_of(periodic_study)
    assert {name: (one.observed, one.included) for name, one in found.items()} == {
        "OFF": (2, 2),
        "DBS": (2, 2),
    }
    assert responses_of(study) == {}  # random levels do not repeat


def test_what_the_model_leaves_is_the_noise(periodic_study: Shown) -> None:
    spectra = unexplained_spectra(periodic_study.analysis, periodic_study.as_analysed)
    assert [one.condition for one in spectra] == ["OFF", "OFF", "DBS", "DBS"]
    # White noise of 0.01 N·m at 250 samples/s in the band up to 10 Hz.
    expected = 0.01 * np.sqrt(2 * (10 - 0.15) / 250)
    assert [one.sd_nm for one in spectra] == pytest.approx([expected] * 4, rel=0.15)


def test_what_does_not_count_has_neither(make_study, make_analysis) -> None:
    excluded = make_study([], analysis=make_analysis({"OFF": 2}, Outcome("excluded", "no")))
    assert responses_of(excluded) == {}
    assert unexplained_spectra(excluded.analysis, excluded.as_analysed) == ()
