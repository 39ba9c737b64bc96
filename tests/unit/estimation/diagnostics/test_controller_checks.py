"""The controller of the settings against the one that moved the joint."""

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.estimation import fit_epochs
from rigidimeter.estimation.diagnostics import checked
from rigidimeter.estimation.prepared import prepare
from rigidimeter.settings import changed_settings, parse_settings
from rigidimeter.virtual.batch import simulate_epochs

JOINT = JointDynamics(0.0045, 0.1368, 1.751)
WRONG = {"controller": {"inertia_kg_m2": 0.0917, "damping_nm_s_rad": 3.21}}
SLOW = {"rig": {"torque": {"rate_hz": 100.0}, "motion": {"rate_hz": 50.0}}}


def found(method, given, rig=None, push_nm=0.0, value=None):
    true = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": push_nm}}, **(rig or {})})
    epoch = simulate_epochs(true, 1, joints=[JOINT], conditions="OFF", seed=3).epoch(0)
    settings = changed_settings(true, given)
    (fit,), _ = fit_epochs([epoch], method, settings)
    if value is not None:
        fit = replace(fit, value=np.array(value))
    (prepared,) = prepare([epoch], settings)
    return {f.name: f for f in checked(prepared, fit).findings}


@pytest.mark.parametrize("rig", [{}, SLOW])
def test_the_controller_that_was_used_is_not_faulted(rig):
    assert not found("iv", {}, rig).keys() & {"controller_misfit", "unstable_loop"}


def test_another_controller_is_told_by_the_command_and_does_not_bias_iv():
    wrong = found("iv", WRONG)["controller_misfit"]
    assert wrong.level == "note"
    assert "less precise with it, not biased" in wrong.text
    assert wrong.value == pytest.approx(50.0, abs=5.0)
    assert "0.5 times as large" in wrong.text


def test_for_least_squares_it_matters_where_the_subject_pushes():
    assert found("bandlimited", WRONG)["controller_misfit"].level == "note"
    assert found("bandlimited", WRONG, push_nm=0.3)["controller_misfit"].level == "doubt"


@pytest.mark.parametrize(
    ("method", "push_nm", "level"), [("bandlimited", 0.3, "doubt"), ("iv", 0.0, "note")]
)
def test_a_loop_that_could_not_have_run_is_told(method, push_nm, level):
    stiff = found(method, {}, push_nm=push_nm, value=[0.0045, 0.1368, 1500.0])["unstable_loop"]
    assert stiff.level == level
    assert stiff.value > 0
    assert "the joint or the controller was another one" in stiff.text or level == "note"
