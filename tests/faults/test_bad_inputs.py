"""Every bad input by the command line: its sentence, its status, and nothing else lost.

Each case stands beside a good recording, which must be analysed all the same.
"""

import json

import numpy as np
import pytest

from rigidimeter.model import JointDynamics

RATE_HZ, N = 200.0, 4000


def recording(seed=0):
    """Twenty seconds of an imposed broad-band motion and its exact torque."""
    t = np.arange(N) / RATE_HZ
    f = np.arange(0.2, 15.0, 0.35)
    w = 2 * np.pi * f
    angle = np.outer(w, t) + np.random.default_rng(seed).uniform(0, 2 * np.pi, f.size)[:, None]
    A = 0.03 / (1 + f)
    x, v, a = A @ np.sin(angle), (A * w) @ np.cos(angle), -(A * w**2) @ np.sin(angle)
    return {
        "time_s": t,
        "torque_nm": JointDynamics(0.02, 0.5, 20.0).torque_nm(x, v, a),
        "angle_rad": x,
    }


def write(path, columns):
    names = list(columns)
    rows = zip(*(np.asarray(columns[name]).tolist() for name in names), strict=True)
    path.write_text(
        ",".join(names) + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows)
    )


def changed(**changes):
    return recording() | changes


def with_run(column, start, stop, value):
    values = recording()[column].copy()
    values[start:stop] = value
    return changed(**{column: values})


def backwards():
    t = recording()["time_s"].copy()
    t[2000] = t[1990]
    return changed(time_s=t)


def text_at(row):
    values = [str(value) for value in recording()["torque_nm"].tolist()]
    values[row] = "oops"
    return changed(torque_nm=np.array(values, dtype=object))


BAD = {
    "missing column": (
        {"Fz" if k == "torque_nm" else k: v for k, v in recording().items()},
        ["the unit of 'Fz' is stated nowhere", "--unit torque=Nm"],
    ),
    "no motion": ({k: v for k, v in recording().items() if k != "angle_rad"}, ["angle_rad"]),
    "text in a number column": (text_at(99), ["torque_nm", "oops", "line 101"]),
    "a run of NaN": (with_run("torque_nm", 1500, 1600, np.nan), ["torque_nm", "7.5", "8"]),
    "constant torque": (with_run("torque_nm", 0, N, 0.5), ["torque_nm is constant", "0.5 N·m"]),
    "constant angle": (with_run("angle_rad", 0, N, 0.0), ["angle_rad is constant"]),
    "one second": ({k: v[:200] for k, v in recording().items()}, ["at least 5 s are needed"]),
    "time backwards": (backwards(), ["time_s", "9.95"]),
    "header alone": ({k: v[:0] for k, v in recording().items()}, ["bad.csv"]),
    "one row": ({k: v[:1] for k, v in recording().items()}, ["bad.csv"]),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_has_its_sentence_and_the_good_one_is_analysed(name, rigidimeter, tmp_path):
    columns, words = BAD[name]
    write(tmp_path / "bad.csv", columns)
    write(tmp_path / "good.csv", recording())
    out = tmp_path / "out.json"
    ran = rigidimeter("estimate", tmp_path / "bad.csv", tmp_path / "good.csv", "--json", out)
    assert ran.status == 1
    assert "bad.csv" in ran.err
    for word in words:
        assert word in ran.err, ran.err
    good = [e for e in json.loads(out.read_text())["epochs"] if e["source"].endswith("good.csv")]
    assert [e["outcome"] for e in good] == ["included"]
    assert good[0]["stiffness_nm_rad"] == pytest.approx(20.0, rel=0.01)
    # Alone, it says the same and still fails.
    assert rigidimeter("estimate", tmp_path / "bad.csv").status == 1


def test_an_empty_file_and_no_file_have_theirs(rigidimeter, tmp_path):
    (tmp_path / "empty.csv").touch()
    ran = rigidimeter("estimate", tmp_path / "empty.csv")
    assert ran.status == 1
    assert "empty.csv is empty" in ran.err
    assert "there is no such file" in rigidimeter("estimate", tmp_path / "none.csv").err


def test_a_run_of_nan_ends_an_epoch_and_both_pieces_are_analysed(rigidimeter, tmp_path):
    write(tmp_path / "bad.csv", with_run("torque_nm", 1900, 2000, np.nan))
    out = tmp_path / "out.json"
    rigidimeter("estimate", tmp_path / "bad.csv", "--json", out)
    epochs = json.loads(out.read_text())["epochs"]
    assert [e["outcome"] for e in epochs] == ["included", "included"]
    for epoch in epochs:
        assert epoch["stiffness_nm_rad"] == pytest.approx(20.0, rel=0.02)


def test_a_gap_ends_an_epoch_and_is_said_without_failing(rigidimeter, tmp_path):
    keep = np.ones(N, dtype=bool)
    keep[1900:2000] = False
    write(tmp_path / "gap.csv", {k: v[keep] for k, v in recording().items()})
    out = tmp_path / "out.json"
    ran = rigidimeter("estimate", tmp_path / "gap.csv", "--json", out)
    assert ran.status == 0, ran.err
    assert "warning" in ran.err
    assert "gap" in ran.err
    assert len(json.loads(out.read_text())["epochs"]) == 2


def test_degrees_given_as_radians_are_refused(rigidimeter, tmp_path):
    columns = recording()
    write(tmp_path / "deg.csv", columns | {"angle_rad": np.rad2deg(columns["angle_rad"])})
    ran = rigidimeter("estimate", tmp_path / "deg.csv")
    assert ran.status == 1
    assert "is more than one turn; say --unit angle=rad or --unit angle=deg" in ran.err


def test_jittered_stamps_are_resampled_by_their_stamps(rigidimeter, tmp_path):
    rng = np.random.default_rng(4)
    t = np.arange(N) / RATE_HZ + rng.uniform(0, 0.002, N)
    f = np.arange(0.2, 15.0, 0.35)
    w = 2 * np.pi * f
    angle = np.outer(w, t) + rng.uniform(0, 2 * np.pi, f.size)[:, None]
    A = 0.03 / (1 + f)
    x, v, a = A @ np.sin(angle), (A * w) @ np.cos(angle), -(A * w**2) @ np.sin(angle)
    torque = JointDynamics(0.02, 0.5, 20.0).torque_nm(x, v, a)
    write(tmp_path / "jitter.csv", {"time_s": t, "torque_nm": torque, "velocity_rad_s": v})
    out = tmp_path / "out.json"
    assert rigidimeter("estimate", tmp_path / "jitter.csv", "--json", out).status == 0
    (epoch,) = json.loads(out.read_text())["epochs"]
    assert epoch["inertia_kg_m2"] == pytest.approx(0.02, rel=0.01)
    assert epoch["damping_nm_s_rad"] == pytest.approx(0.5, rel=0.01)
    assert epoch["stiffness_nm_rad"] == pytest.approx(20.0, rel=0.01)
