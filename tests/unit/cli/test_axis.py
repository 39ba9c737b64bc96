"""What K includes of the limb's weight is stated by the axis of the joint."""

import json
import shutil

import numpy as np
import pytest

from rigidimeter.analysis.study import estimate_study, load_study

INCLUDES = "K includes the slope of the limb's weight "
STATED = [
    ('axis = "horizontal"', INCLUDES + "(not corrected)"),
    ("gravity_nm = 0.4", INCLUDES + "(K without it: note gravity)"),
    ('axis = "vertical"', ""),
]


@pytest.fixture
def table(tmp_path):
    """A recording of another program: 20 s at 200 samples/s."""
    rng = np.random.default_rng(1)
    time_s = np.arange(4000) / 200
    parts = [(f, rng.uniform(0, 2 * np.pi)) for f in (0.3, 0.7, 1.3, 2.3, 3.7, 5.3, 7.1)]
    angle = sum(0.02 * np.sin(2 * np.pi * f * time_s + phase) for f, phase in parts)
    velocity = np.gradient(angle, time_s)
    torque = 0.0045 * np.gradient(velocity, time_s) + 0.137 * velocity + 1.751 * angle
    torque += 0.01 * rng.standard_normal(torque.size)
    np.savez(tmp_path / "elbow.npz", time_s=time_s, torque_nm=torque, angle_rad=angle)
    return tmp_path / "elbow.npz"


@pytest.mark.parametrize(("line", "sentence"), STATED, ids=[line for line, _ in STATED])
def test_it_is_stated_where_it_is_known(rigidimeter, table, tmp_path, line, sentence):
    settings = tmp_path / "rig.toml"
    settings.write_text(f"[diagnostics]\n{line}\n")
    ran = rigidimeter("estimate", table, "--settings", settings, "--json", tmp_path / "e.json")
    assert ran.status == 0, ran.err
    shown = " ".join(ran.out.split())
    assert "measured at angle SD" in shown
    assert sentence in shown if sentence else "limb" not in shown
    words = json.loads((tmp_path / "e.json").read_text())["weight_in_stiffness"]
    assert f"K {words}" == sentence if sentence else words == ""


def test_where_the_axis_is_unknown_a_line_says_how_to_state_it(rigidimeter, table, tmp_path):
    ran = rigidimeter("estimate", table, "--json", tmp_path / "e.json")
    assert "K may include limb weight (set diagnostics.axis); " in " ".join(ran.out.split())
    words = json.loads((tmp_path / "e.json").read_text())["weight_in_stiffness"]
    assert f"K {words}" == INCLUDES + "unless the axis is vertical"


def test_a_weight_about_a_vertical_axis_is_refused(rigidimeter, table, tmp_path):
    settings = tmp_path / "rig.toml"
    settings.write_text('[diagnostics]\naxis = "vertical"\ngravity_nm = 0.4\n')
    ran = rigidimeter("estimate", table, "--settings", settings)
    assert ran.status == 1
    assert ran.err.startswith(f"rigidimeter: {settings}: diagnostics: axis = ")
    assert "gravity_nm = 0.4 N·m contradict each other" in ran.err


def test_the_virtual_rig_is_vertical_unless_a_study_states_another_axis(fitted_study, tmp_path):
    assert estimate_study(load_study(fitted_study))[0].axis == "vertical"
    study = shutil.copytree(fitted_study, tmp_path / "study")
    with (study / "study.toml").open("a") as file:
        file.write('\n[analysis]\naxis = "horizontal"\n')
    found, _ = estimate_study(load_study(study))
    assert found.weight_in_stiffness.endswith("(not corrected)")
