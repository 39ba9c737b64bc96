"""A failure that does not move J, B and K of the method used is a note."""

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import fit_epochs
from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.settings import parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

JOINT = JointDynamics(0.0045, 0.1368, 1.751)


def found(method, subject, levels=None):
    settings = parse_settings(
        {"subject": {"OFF": subject}, "diagnostics": {"levels": levels or {}}}
    )
    epochs = [simulate_epochs(settings, 1, joints=[JOINT], conditions="OFF", seed=3).epoch(0)]
    (fit,), _ = fit_epochs(epochs, method, settings)
    (prepared,) = prepare(epochs, settings)
    return {f.name: f for f in checked(prepared, fit).findings}


@pytest.mark.parametrize("level", ["note", "exclude"])
def test_a_level_that_was_set_is_used_in_any_case(level):
    by_iv = found("iv", {"voluntary_sd_nm": 0.2}, {"voluntary_torque": level})
    assert by_iv["voluntary_torque"].level == level


@pytest.mark.parametrize(
    ("push_nm", "r_squared", "doubted"), [(0.5, 0.29, True), (0.5, 0.31, False), (0.0, 0.29, True)]
)
def test_a_small_r_squared_is_a_doubt_for_least_squares(push_nm, r_squared, doubted):
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": push_nm}}})
    epochs = [simulate_epochs(settings, 1, joints=[JOINT], conditions="OFF", seed=3).epoch(0)]
    (prepared,) = prepare(epochs, settings)
    for method, level in (("bandlimited", "caution"), ("iv", "note")):
        (fit,), _ = fit_epochs(epochs, method, settings)
        findings = checked(prepared, replace(fit, r_squared=r_squared)).findings
        assert [f.level for f in findings if f.name == "r_squared"] == [level] * doubted
    assert np.isfinite(fit.value).all()
