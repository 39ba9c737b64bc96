"""The checks on a measured ankle: nothing to exclude, and faults that are put in are found."""

import re
from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import (
    epoch_signals,
    fit_inertia_damping_stiffness,
    method_named,
)
from rigidimeter.analysis.estimation.diagnostics import Case, checked, diagnose
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.analysis.estimation.terms import fit_terms, wideband_signals
from rigidimeter.analysis.estimation.uncertainty import hac_covariance
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.readers import read_recording
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
    signals = epoch_signals(epoch, "bandlimited", SETTINGS.estimation)
    parameters = fit_inertia_damping_stiffness(signals).value
    return {f.name: f for f in diagnose(Case(epoch, signals, parameters, SETTINGS.diagnostics))}


def test_a_measured_epoch_is_sound(ankle):
    found = diagnosed(ankle)
    assert {name for name, finding in found.items() if finding.level != "note"} == set()
    # An imposed motion leaves a residual that is far from white.
    assert "residual_whiteness" in found


@pytest.mark.parametrize(
    ("fault", "name"),
    [
        (lambda values: np.clip(values, np.quantile(values, 0.02), None), "saturation"),
        (lambda values: np.where(np.arange(values.size) // 500 == 9, 0.0, values), "frozen"),
    ],
)
def test_a_fault_of_the_sensor_is_found(ankle, fault, name):
    torque = ankle.channels["torque_nm"]
    broken = Channel("torque_nm", torque.time_s, fault(torque.values))
    found = diagnosed(replace(ankle, channels={**ankle.channels, "torque_nm": broken}))
    assert found[name].level == "exclude"
    assert found[name].facts["channel"] == "torque_nm"


def test_intervals_for_a_coloured_residual_are_wider_than_those_for_a_white_one(ankle):
    signals = epoch_signals(ankle, "bandlimited", SETTINGS.estimation)
    solution = fit_inertia_damping_stiffness(signals)
    A = np.column_stack([signals.acceleration_rad_s2, signals.velocity_rad_s, signals.angle_rad])
    residual = signals.torque_nm - A @ solution.value
    coloured = hac_covariance(np.linalg.inv(A.T @ A), A * residual[:, None])
    textbook = np.std(residual) * np.sqrt(np.diag(np.linalg.inv(A.T @ A)))
    assert coloured.standard_errors[2] > 2.0 * textbook[2]


@pytest.mark.parametrize("name", ["z_df", "z_df2", "z_pf"])
def test_the_reflex_that_is_left_out_is_named_with_what_it_does_to_k(shared_data, name):
    named = 0
    for prepared in prepare(epochs_of(shared_data, name), SETTINGS):
        (fit,), _ = method_named("bandlimited").fit([prepared], None, lambda _: None, False)
        (finding,) = (f for f in checked(prepared, fit).findings if f.name == "missing_term")
        reflexes = re.findall(r"reflex[^,]*[+-]", finding.facts["asked"])
        if not reflexes:
            continue
        named += 1
        assert finding.level == "caution"
        (term,), band_hz = reflexes, fit.band_hz
        alone = finding.facts.get(f"K_percent_of_{term}", finding.effect.percent[2])
        included = fit_terms(
            wideband_signals(prepared.epoch, band_hz[1]),
            f"inertia,damping,stiffness,{term}",
            band_hz,
        )
        changed = 100 * (included["stiffness"].value / fit.stiffness_nm_rad - 1)
        print(name, term, alone, changed)
        assert 0.5 < -alone / changed < 2.0
    assert named >= 2
