"""The controller of the settings against the one that moved the joint."""

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import fit_epochs
from rigidimeter.analysis.estimation.closedloop.controller_used import command_made, loop_of
from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.settings import changed_settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

JOINT = JointDynamics(0.0045, 0.1368, 1.751)
WRONG = {"controller": {"inertia_kg_m2": 0.0917, "damping_nm_s_rad": 3.21}}
PER_DEGREE = {"controller": {"inertia_kg_m2": 0.0008, "damping_nm_s_rad": 0.028}}
SLOW = {"rig": {"torque": {"rate_hz": 100.0}, "motion": {"rate_hz": 50.0}}}


def fitted(method, given, rig=None, push_nm=0.0):
    true = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": push_nm}}, **(rig or {})})
    epoch = simulate_epochs(true, 1, joints=[JOINT], conditions="OFF", seed=3).epoch(0)
    settings = changed_settings(true, given)
    (fit,), _ = fit_epochs([epoch], method, settings)
    return epoch, settings, fit


def found(method, given, rig=None, push_nm=0.0, value=None):
    epoch, settings, fit = fitted(method, given, rig, push_nm)
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
    assert wrong.facts["variant"].endswith("instrument")
    assert wrong.value == pytest.approx(50.0, abs=5.0)
    assert wrong.facts["factor"] == pytest.approx(0.5, abs=0.05)


def test_for_least_squares_it_matters_where_the_subject_pushes():
    assert found("bandlimited", WRONG)["controller_misfit"].level == "note"
    assert found("published", WRONG, push_nm=0.3)["controller_misfit"].level == "caution"


@pytest.mark.parametrize("push_nm", [0.0, 0.3])
@pytest.mark.parametrize("times", [1 / 300, 1 / 57.3, 1 / 5, 1 / 2, 2, 57.3])
def test_iv_is_as_good_whatever_the_controller(times, push_nm):
    used = parse_settings({}).controller
    inertia, damping = used.inertia_kg_m2 * times, used.damping_nm_s_rad * times
    given = {"controller": {"inertia_kg_m2": inertia, "damping_nm_s_rad": damping}}
    _, _, right = fitted("iv", {}, push_nm=push_nm)
    _, _, wrong = fitted("iv", given, push_nm=push_nm)
    assert wrong.outcome.included
    half = (right.high - right.low) / 2
    assert np.all(np.abs(wrong.value - right.value) < 0.5 * half)
    assert np.all((wrong.high - wrong.low) / 2 < 2.0 * half)


def test_a_controller_given_per_degree_is_named_with_the_one_that_the_recording_shows():
    both = found("iv", PER_DEGREE)
    assert both["unstable_loop"].level == both["controller_misfit"].level == "note"
    assert both["unstable_loop"].facts["variant"] == "instrument"
    misfit = both["controller_misfit"]
    assert misfit.facts["variant"] == "per_degree instrument"
    assert misfit.facts["factor"] == pytest.approx(57.3, rel=0.05)
    assert misfit.facts["shown_inertia"] == pytest.approx(0.0458, rel=0.01)
    assert misfit.facts["shown_damping"] == pytest.approx(1.604, rel=0.01)
    assert "per degree" in misfit.remedy


@pytest.mark.parametrize("imposed_rad_s", [0.0, 0.33])
def test_a_movement_that_is_imposed_beside_the_perturbation_is_no_other_controller(imposed_rad_s):
    epoch, settings, _ = fitted("bandlimited", {})
    command = epoch.channels["velocity_command_rad_s"]
    moved = command.values + imposed_rad_s * np.sin(2 * np.pi * 0.53 * command.time_s)
    channels = {**epoch.channels, "velocity_command_rad_s": replace(command, values=moved)}
    loop = loop_of(settings, epoch.channels["torque_nm"].rate_hz, None)
    made = command_made(replace(epoch, channels=channels), loop)
    assert made.misfit(loop.controller)[0] < 5.0
    other = loop.controller.model_copy(update=WRONG["controller"])
    assert made.misfit(other)[0] == pytest.approx(50.0, abs=5.0)
    shown = made.shown(other)
    assert shown.inertia_kg_m2 == pytest.approx(loop.controller.inertia_kg_m2, rel=0.05)
    assert shown.damping_nm_s_rad == pytest.approx(loop.controller.damping_nm_s_rad, rel=0.05)


@pytest.mark.parametrize("times", [10.0, 57.3])
def test_a_loop_that_was_another_does_not_say_that_least_squares_is_unbiased(times):
    given = {"controller": {"inertia_kg_m2": 0.0458 * times, "damping_nm_s_rad": 1.604 * times}}
    pushed = found("published", given, push_nm=0.1)
    assert pushed["controller_misfit"].level == pushed["loop_bias"].level == "caution"


def test_a_command_that_no_controller_makes_leaves_the_bias_of_least_squares_unknown():
    epoch, settings, fit = fitted("bandlimited", {})
    command = epoch.channels["velocity_command_rad_s"]
    other = replace(command, values=command.values[::-1].copy())
    epoch = replace(epoch, channels={**epoch.channels, command.name: other})
    (prepared,) = prepare([epoch], settings)
    (misfit,) = (f for f in checked(prepared, fit).findings if f.name == "controller_misfit")
    assert misfit.level == "caution"
    assert "variant" not in misfit.facts


@pytest.mark.parametrize(
    ("method", "push_nm", "level"), [("bandlimited", 0.3, "caution"), ("iv", 0.0, "note")]
)
def test_a_loop_that_could_not_have_run_is_told(method, push_nm, level):
    stiff = found(method, {}, push_nm=push_nm, value=[0.0045, 0.1368, 1500.0])["unstable_loop"]
    assert stiff.level == level
    assert stiff.value > 0
    assert ("variant" in stiff.facts) == (level == "note")
