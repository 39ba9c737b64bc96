"""Recordings and epochs of joints that differ are told, and which of them do."""

from dataclasses import replace

import pytest

from rigidimeter.analysis.recording import estimate
from rigidimeter.core.settings import parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs


def test_recordings_of_another_joint_are_a_finding():
    """J 20 % higher in one of two recordings."""
    joints = [JointDynamics(0.0045 * factor, 0.1368, 1.751) for factor in (1.0, 1.0, 1.2, 1.2)]
    batch = simulate_epochs(parse_settings({}), 4, joints=joints, conditions="OFF", seed=2)
    epochs = [replace(batch.epoch(i), source=f"day{i // 2}.csv") for i in range(4)]
    (found,) = estimate(epochs, "iv").across
    assert (found.name, found.level) == ("inertia_of_recordings", "caution")
    assert found.value == pytest.approx(20.0, abs=1.0)
    assert found.headline == "J of day1.csv is 20 % above that of day0.csv"
    assert estimate(epochs[:2], "iv").across == ()


def test_epochs_whose_stiffness_differs_are_named_in_the_pooled_fit():
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": 0.02}}})
    factors = (0.7, 1.3, 0.8, 1.1)
    joints = [JointDynamics(0.0045, 0.1368, 1.751 * factor) for factor in factors]
    batch = simulate_epochs(settings, 4, joints=joints, conditions="OFF", seed=2)
    days = [replace(batch.epoch(i), source=f"/data/day-{i // 2}") for i in range(4)]
    analysis = estimate(days, "iv", settings=settings)
    (finding,) = (f for f in analysis.pooled[0].findings if f.name == "varying_between_epochs")
    assert finding.value == pytest.approx(60 / 0.975, rel=0.05)
    assert (finding.facts["symbol"], finding.facts["low_at"]) == ("K", "epoch 0 of day-0")
    assert finding.facts["high"] == pytest.approx(2.25, abs=0.05)
    # A joint is not the same twice: a number, and no warning unless the settings ask for one.
    assert finding.level == "note"
