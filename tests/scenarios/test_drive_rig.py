"""J, B and K from rigs whose drives are not those of the virtual rig, in continuous time."""

from __future__ import annotations

import numpy as np
import pytest
from tests.scenarios.drive_rig import TRUTH, DriveRig, run

from rigidimeter.records import Epoch
from rigidimeter.settings import parse_settings
from rigidimeter.study import estimate

MOST = np.array([0.02, 0.01, 0.005])


def fits_of(rig: DriveRig, epochs: int = 2):
    settings = parse_settings({"estimation": {"torque_lowpass_hz": rig.lowpass_hz}})
    recorded: list[Epoch] = [run(rig, seed) for seed in range(epochs)]
    return estimate(recorded, "iv", settings=settings).fits


@pytest.mark.parametrize(
    "rig",
    [
        DriveRig("second order", 200.0),
        DriveRig("PI", 200.0),
        DriveRig("PI", 500.0, edge_s=0.0004),
        DriveRig("PI with lag", 200.0, lowpass_hz=100.0),
        DriveRig("position loop", 333.0),
        DriveRig("friction", 1000.0, lowpass_hz=100.0),
        DriveRig("PI", 200.0, lowpass_hz=30.0),
    ],
    ids=str,
)
def test_the_drive_is_found_and_the_joint_with_it(rig):
    for fit in fits_of(rig):
        assert np.all(np.abs(fit.value / TRUTH - 1) < MOST)
        assert "between_samples" not in {finding.name for finding in fit.findings}


@pytest.mark.parametrize("rig", [DriveRig("friction", 200.0), DriveRig("friction", 333.0)], ids=str)
def test_what_cannot_be_known_is_doubted_with_an_interval_that_covers(rig):
    for fit in fits_of(rig):
        (finding,) = (one for one in fit.findings if one.name == "between_samples")
        assert finding.level == "doubt"
        assert "torque_lowpass_hz" in finding.remedy
        assert np.all((fit.low <= TRUTH) & (fit.high >= TRUTH))


def test_least_squares_says_what_j_loses_between_the_samples():
    found = estimate([run(DriveRig("PI", 1000.0), 1)], "bandlimited").fits[0]
    (finding,) = (one for one in found.findings if one.name == "between_samples")
    lost = 100 * (1 - found.value[0] / TRUTH[0])
    assert finding.value == pytest.approx(lost, abs=3.0)
