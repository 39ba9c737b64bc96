"""Estimates of a recording: its settings, the second stage with J held, what is left out."""

import math

import numpy as np
import pytest

from rigidimeter.analysis.estimation import task_of
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.recording import estimate
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Channel, Epoch, Outcome
from rigidimeter.core.settings import Settings, parse_settings


def epochs_with_inertia(inertias, closed=None):
    """Exact broad-band motions of joints that differ in inertia alone."""
    t = np.arange(6000) / 300.0
    f = np.arange(0.2, 20.0, 0.35)
    w = 2 * np.pi * f
    made = []
    for k, J in enumerate(inertias):
        phase = np.random.default_rng(k).uniform(0, 2 * np.pi, f.size)
        angle = np.outer(w, t) + phase[:, None]
        A = 0.05 / (1 + f)
        x, v, a = A @ np.sin(angle), (A * w) @ np.cos(angle), -(A * w**2) @ np.sin(angle)
        channels = {
            "torque_nm": Channel("torque_nm", t, J * a + 0.14 * v + 1.7 * x),
            "angle_rad": Channel("angle_rad", t, x),
        }
        outcome = (closed or {}).get(k, Outcome())
        made.append(Epoch("s", str(k), channels, task="prbs", closed=outcome))
    return made


def test_a_recording_is_estimated_with_its_settings():
    epochs = tuple(epochs_with_inertia([0.004, 0.005]))
    settings = parse_settings({"estimation": {"band_high_closed_loop_hz": 12.0}})
    found = estimate(Recording(epochs, (), settings, ()), "bandlimited")
    assert found == estimate(epochs, "bandlimited", settings=settings)
    assert found.fits[0].band_hz == pytest.approx((0.1, 12.0))
    assert estimate(epochs, "bandlimited") == estimate(epochs, "bandlimited", settings=Settings())
    with pytest.raises(ValueError, match="method 'magic': there is no such method"):
        estimate(epochs, "magic")


@pytest.mark.parametrize("given", ["elbow.csv", None, ["elbow.csv"]])
def test_only_a_recording_or_epochs_are_estimated(given):
    with pytest.raises(UserError, match="takes a Recording or a list of its epochs"):
        estimate(given)


def test_the_second_stage_holds_the_median_inertia_of_the_included():
    epochs = epochs_with_inertia([0.004, 0.005, 0.009, 0.02], {3: Outcome("excluded", "limit")})
    found = estimate(epochs, settings=Settings())
    assert found.inertia_kg_m2 == pytest.approx(0.005, rel=1e-3)
    assert {f.inertia_kg_m2 for f in found.fixed_inertia} == {found.inertia_kg_m2}
    assert found.fixed_inertia[1].damping_nm_s_rad == pytest.approx(0.14, rel=1e-3)
    assert found.fixed_inertia[3].outcome.reason == "limit"


def test_without_an_included_epoch_there_is_no_second_stage():
    epochs = epochs_with_inertia([0.004], {0: Outcome("excluded", "limit")})
    found = estimate(epochs, settings=Settings())
    assert math.isnan(found.inertia_kg_m2)
    assert math.isnan(found.fixed_inertia[0].damping_nm_s_rad)
    assert found.fits[0].damping_nm_s_rad == pytest.approx(0.14, rel=1e-3)


def test_a_bad_epoch_does_not_stop_the_good_ones():
    good, bad = epochs_with_inertia([0.004, 0.004])
    t = np.arange(100) / 100.0
    bad = Epoch("s", "bad", {"torque_nm": Channel("torque_nm", t, t),
                             "angle_rad": Channel("angle_rad", t, t)})  # fmt: skip
    found = estimate([bad, good], settings=Settings())
    assert [f.outcome.kind for f in found.fits] == ["failed", "included"]


def test_the_task_is_told_from_the_motion_where_it_is_not_said():
    t = np.arange(2000) / 100.0
    sine = {"torque_nm": Channel("torque_nm", t, np.cos(2 * np.pi * t)),
            "angle_rad": Channel("angle_rad", t, np.sin(2 * np.pi * t))}  # fmt: skip
    assert task_of(Epoch("f", "1", sine), Settings()) == "sinusoid"
    assert task_of(Epoch("f", "1", sine, task="prbs"), Settings()) == "prbs"
    (broad,) = epochs_with_inertia([0.004])
    assert task_of(Epoch("f", "1", broad.channels), Settings()) == "prbs"
