"""`rm.fit_terms` gives what `rigidimeter model` prints, as a table."""

import numpy as np
import pytest
from tests.known_joint import TRUTH, angle_rad, torque_nm

import rigidimeter as rm
from rigidimeter.core.errors import UserError

RATE_HZ = 200.0
FRICTION_NM = 0.1
JOINT = "inertia,damping,stiffness"


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> rm.analysis.reading.Recording:
    time_s = np.arange(0, 20, 1 / RATE_HZ)
    torque = torque_nm(time_s) + FRICTION_NM * np.sign(angle_rad(time_s, derivative=1))
    path = tmp_path_factory.mktemp("friction") / "joint.npz"
    np.savez(path, torque_nm=torque, angle_rad=angle_rad(time_s), rate_hz=RATE_HZ)
    return rm.read(path)


def test_a_term_of_friction_is_recommended_and_frees_damping_of_it(recording) -> None:
    found = rm.fit_terms(recording, [JOINT, f"{JOINT},coulomb"], compare=True)
    assert found.recommended == (f"{JOINT},coulomb",)
    assert repr(found) == f"torque of 1 epoch as a sum of terms; recommended: {JOINT},coulomb"
    table = found.table().set_index(["model", "parameter"])
    with_friction = table.loc[f"{JOINT},coulomb"]
    values = with_friction["value"].to_numpy()
    assert values[:4] == pytest.approx([*TRUTH, FRICTION_NM], rel=0.05)
    assert table.loc[(JOINT, "damping"), "value"] > 1.2 * TRUTH[1]
    assert [*with_friction["unit"]] == ["kg·m²", "N·m·s/rad", "N·m/rad", "N·m", "rad/s"]


def test_without_terms_it_is_the_joint_alone(recording) -> None:
    found = rm.fit_terms(recording)
    assert [*found.table()["parameter"]] == JOINT.split(",")
    assert found.problems == ()
    assert "<table" in found._repr_html_()


def test_what_cannot_be_fitted_is_refused_in_a_sentence(recording) -> None:
    with pytest.raises(UserError, match="there is no term 'spring'"):
        rm.fit_terms(recording, "inertia,spring")
    with pytest.raises(UserError, match="begin the band at 0 Hz or leave offset out"):
        rm.fit_terms(recording, f"{JOINT},offset")


def test_a_model_that_cannot_be_fitted_beside_one_that_can_is_a_problem(recording) -> None:
    found = rm.fit_terms(recording, [JOINT, f"{JOINT},offset"])
    assert len(found.table()) == 3
    assert "leave offset out" in repr(found)


def test_single_terms_are_not_taken_for_models(recording, rigidimeter, tmp_path) -> None:
    """Each text is a model; a list of terms would be models of one term each, none a joint."""
    sentence = "each text is a model of its own; say 'inertia,damping' for one"
    with pytest.raises(UserError, match=sentence):
        rm.fit_terms(recording, ["inertia", "damping"])
    ran = rigidimeter("model", recording.paths[0], "--terms", "inertia", "--terms", "damping")
    assert ran.status == 1
    assert sentence in ran.err


@pytest.mark.parametrize("terms", [7, [1, 2], {"inertia"}])
def test_terms_that_are_no_text_are_refused_in_a_sentence(recording, terms) -> None:
    with pytest.raises(UserError, match="terms are a text such as 'inertia,damping,stiffness'"):
        rm.fit_terms(recording, terms)


def test_a_path_in_place_of_a_recording_is_refused_in_a_sentence() -> None:
    with pytest.raises(UserError, match=r"takes a Recording; read a path with rigidimeter\.read"):
        rm.fit_terms("joint.npz", JOINT)
