import json

import numpy as np
import pytest

from rigidimeter.core.settings import SubjectSettings

FAST = {"torque": {"rate_hz": 1000.0}, "motion": {"rate_hz": 1000.0}}


@pytest.fixture
def joint(tmp_path):
    """A joint with a cubic spring, a table of 40 s at 200 samples/s."""
    rng = np.random.default_rng(4)
    t = np.arange(8000) / 200.0
    frequency_hz = np.linspace(0.2, 6.0, 40)[:, None]
    phase = 2 * np.pi * frequency_hz * t + rng.uniform(0, 2 * np.pi, 40)[:, None]
    scale, w = 0.02 / (1 + frequency_hz), 2 * np.pi * frequency_hz
    x = (scale * np.sin(phase)).sum(0)
    v = (scale * w * np.cos(phase)).sum(0)
    a = (-scale * w**2 * np.sin(phase)).sum(0)
    torque = 0.01 * a + 0.2 * v + 3 * x + 2000 * x**3 + 0.2 + 0.01 * rng.standard_normal(t.size)
    rows = "".join(f"{p},{q},{r}\n" for p, q, r in zip(t, x, torque, strict=True))
    (tmp_path / "joint.csv").write_text("time_s,angle_rad,torque_nm\n" + rows)
    return tmp_path / "joint.csv"


def test_terms_are_fitted_and_written(rigidimeter, joint, tmp_path):
    ran = rigidimeter(
        "model", joint, "--terms", "inertia,damping,stiffness,cubic,offset", "--band-hz", 0, 15,
        "--json", tmp_path / "m.json",
    )  # fmt: skip
    assert ran.status == 0, ran.err
    document = json.loads((tmp_path / "m.json").read_text())
    assert document["schema"] == "rigidimeter.model/2"
    (epoch,) = document["epochs"]
    assert epoch["band_hz"] == [0.0, 15.0]  # up to where it was asked for
    found = {p["term"]: p["value"] for p in epoch["models"][0]["parameters"]}
    assert found["cubic"] == pytest.approx(2000, rel=0.05)
    assert found["offset"] == pytest.approx(0.2, abs=0.01)
    assert "cubic" in ran.out
    assert "N·m/rad³" in ran.out


def test_own_candidates_are_compared(rigidimeter, joint, tmp_path):
    ran = rigidimeter(
        "model", joint, "--terms", "inertia,damping,stiffness", "--terms", "damping,stiffness",
        "--compare", "--json", tmp_path / "m.json",
    )  # fmt: skip
    assert ran.status == 0, ran.err
    (epoch,) = json.loads((tmp_path / "m.json").read_text())["epochs"]
    assert [model["terms"] for model in epoch["models"]] == [
        ["inertia", "damping", "stiffness"],
        ["damping", "stiffness"],
    ]


def test_a_session_is_modelled(rigidimeter, simulate):
    ran = rigidimeter("model", simulate())
    assert ran.status == 0, ran.err
    assert "inertia+damping+stiffness, VAF" in ran.out
    assert "±" in ran.out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ["--terms", "inertia,magic"],
            "there is no term 'magic'; known: inertia, damping, stiffness",
        ),
        (["--terms", "reflex-slow"], "followed by + or - for the direction"),
        (["--terms", "inertia,offset"], "offset is constant and does not pass a band"),
        (
            ["--terms", "damping,directional-damping"],
            "cannot distinguish damping, damping+ and damping-",
        ),
        (["--method", "published"], "--method published: terms are fitted only with bandlimited"),
        (["--band-hz", "0", "-1"], "--band-hz 0 -1: the upper edge must be above 0 Hz"),
    ],
)
def test_what_is_wrong_is_one_sentence(rigidimeter, joint, options, words):
    ran = rigidimeter("model", joint, *options)
    assert ran.status == 1
    assert words in ran.err


def _unrelated(angle, rng):
    """A torque of 0.5 N·m that has nothing to do with the motion."""
    return np.convolve(rng.standard_normal(angle.size + 19), np.full(20, 0.1), "valid")


def _gravity(angle, rng):
    """What a controller adds to carry the arm: a function of the angle, never measured."""
    del rng
    return 1.2 * np.sin(angle + 0.4)


def _steps(angle, rng):
    """A train of steps, one a second."""
    levels = np.repeat(rng.choice([-0.5, 0.0, 0.5], 40), 200)
    return levels[: angle.size] + 0.005 * rng.standard_normal(angle.size)


@pytest.mark.parametrize(
    ("torque", "words"),
    [
        (_unrelated, "none of these models"),
        (_gravity, "The torque is a function of the angle alone"),
        (_steps, "none of these models"),
    ],
)
def test_a_torque_that_is_no_joints_has_no_model(rigidimeter, joint, tmp_path, torque, words):
    rng = np.random.default_rng(7)
    time_s, angle, _ = np.loadtxt(joint, delimiter=",", skiprows=1).T
    values = np.column_stack([time_s, angle, torque(angle, rng)])
    table = tmp_path / "other.csv"
    np.savetxt(table, values, "%.9g", ",", header="time_s,angle_rad,torque_nm", comments="")
    ran = rigidimeter("model", table, "--compare", "--band-hz", 0.15, 15, "--json", tmp_path / "m")
    assert ran.status == 1
    (epoch,) = json.loads((tmp_path / "m").read_text())["epochs"]
    assert epoch["recommended"] is None
    assert words in epoch["why"]
    assert words in " ".join(ran.out.split())


def test_the_checks_of_an_estimate_are_shown(rigidimeter, joint, tmp_path):
    ran = rigidimeter("model", joint, "--band-hz", 0.15, 15, "--json", tmp_path / "m.json")
    assert ran.status == 0, ran.err
    (epoch,) = json.loads((tmp_path / "m.json").read_text())["epochs"]
    assert "varying_with_angle" in [finding["name"] for finding in epoch["findings"]]
    headline = epoch["findings"][0]["headline"]
    assert f"{epoch['findings'][0]['name']} {headline}" in " ".join(ran.out.split())


@pytest.mark.parametrize(
    ("push_nm", "tables"),
    [
        (0.0, {"rig": {"tick_rate_hz": 1000.0, **FAST}, "prbs": {"duration_s": 8.0}}),
        (0.3, {}),
    ],
)
def test_j_b_and_k_are_the_joints(rigidimeter, simulate, tmp_path, push_nm, tables):
    """Torque at a tick misses part of the acceleration; the subject pushes: neither is a bias."""
    joint = SubjectSettings(voluntary_sd_nm=push_nm)
    session = simulate(subject={"OFF": {"voluntary_sd_nm": push_nm}}, **tables)
    ran = rigidimeter("model", session, "--json", tmp_path / "m.json")
    assert ran.status == 0, ran.err
    (epoch,) = json.loads((tmp_path / "m.json").read_text())["epochs"]
    (row,) = epoch["models"]
    found = {one["term"]: (one["value"], one["standard_error"]) for one in row["parameters"]}
    truth = {
        "inertia": joint.inertia_kg_m2,
        "damping": joint.damping_nm_s_rad,
        "stiffness": joint.stiffness_nm_rad,
    }
    assert found.keys() == truth.keys()
    for name, (value, error) in found.items():
        assert value == pytest.approx(truth[name], abs=2.5 * error)
    assert {one["level"] for one in epoch["findings"]} <= {"note"}
    named = [one["name"] for one in epoch["findings"]]
    assert ("voluntary_torque" in named) == bool(push_nm)
