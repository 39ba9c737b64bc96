"""The checks on a measured ankle: nothing to exclude, and faults that are put in are found."""

from dataclasses import replace

import numpy as np
import pytest

import rigidimeter as rm
from rigidimeter.analysis.estimation import estimate_recorded, prepare
from rigidimeter.analysis.reading import ReadOptions, Recording, read_recording
from rigidimeter.analysis.recording import fit_terms
from rigidimeter.core.records import Channel
from rigidimeter.core.settings import Settings

SETTINGS = Settings()


def epochs_of(shared_data, name):
    options = ReadOptions(
        columns={"angle_rad": "position_rad", "torque_nm": "torque_Nm"},
        reaction=True,
        epoch_length_s=20.0,
    )
    return read_recording(shared_data / "ankle" / f"{name}.npz", options)[0]


@pytest.fixture(scope="module")
def ankle(shared_data):
    return epochs_of(shared_data, "z_df")[0]


def diagnosed(epoch):
    """Return what the checks of an epoch find; terms are another test."""
    recorded = prepare([epoch], SETTINGS, clocks=False)
    (fit,) = estimate_recorded(recorded, "bandlimited", fits_alone=True).fits
    return {finding.name: finding for finding in fit.findings}


def test_a_measured_epoch_is_sound(ankle):
    found = diagnosed(ankle)
    # Without its reflex the frequencies do not agree; that is what terms are for. What J, B and K
    # leave from 0.3 to 4 Hz is 16.1 % of the torque, by a plain periodogram of the whole epoch.
    assert {name for name, finding in found.items() if finding.level != "note"} == {
        "unweighted_fit", "voluntary_torque",
    }  # fmt: skip
    assert found["voluntary_torque"].value == pytest.approx(16.1, abs=1.0)
    # An imposed motion leaves a residual that is far from white.
    assert "residual_whiteness" in found


@pytest.mark.parametrize(
    ("fault", "name", "level"),
    [
        (lambda values: np.clip(values, np.quantile(values, 0.02), None), "saturation", "exclude"),
        (
            lambda values: np.where(np.arange(values.size) // 500 == 9, 0.0, values),
            "frozen",
            "note",
        ),
    ],
)
def test_a_fault_of_the_sensor_is_found(ankle, fault, name, level):
    """One that is left out is a note."""
    torque = ankle.channels["torque_nm"]
    broken = Channel("torque_nm", torque.time_s, fault(torque.values))
    found = diagnosed(replace(ankle, channels={**ankle.channels, "torque_nm": broken}))
    assert found[name].level == level
    assert found[name].facts["channel"] == "torque_nm"


@pytest.mark.parametrize("name", ["z_df", "z_df2", "z_pf"])
def test_the_reflex_that_is_left_out_is_named_and_beside_it_k_is_as_estimated(shared_data, name):
    epochs = epochs_of(shared_data, name)
    (pooled,) = rm.estimate(epochs, "bandlimited", settings=SETTINGS).pooled
    (finding,) = (f for f in pooled.findings if f.name == "missing_term")
    asked, percent = finding.facts["asked"], finding.effect.percent[2]
    assert "reflex" in asked
    table = fit_terms(Recording(tuple(epochs), (), SETTINGS, ()), asked).table()
    stiffness = table[table["parameter"] == "stiffness"]["value"]
    print(name, asked, percent, pooled.value[2], list(stiffness))
    assert len(stiffness) == len(epochs)
    # Of z_df, K hangs on how lines are weighted, with J, B and K alone too (`unweighted_fit`).
    if abs(percent) > 10:
        assert stiffness.median() == pytest.approx(pooled.value[2], rel=0.25)
