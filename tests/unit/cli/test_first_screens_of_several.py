"""`model`, `ratings` and `inspect` of several epochs, examiners, files: one screen by default."""

import re

import numpy as np
import pytest

ROWS = 24


def lines_of(ran) -> list[str]:
    assert ran.status == 0, ran.err
    lines = ran.out.rstrip("\n").split("\n")
    assert max(map(len, lines)) <= 80, ran.out
    return lines


@pytest.fixture(scope="module")
def six_epochs(tmp_path_factory):
    """Six epochs of 10 s of a moving joint without friction, with noise of 5 mN·m."""
    path = tmp_path_factory.mktemp("model") / "joint.csv"
    rng = np.random.default_rng(3)
    time_s = np.arange(6000) / 100.0
    phases = rng.uniform(0.0, 2.0 * np.pi, 40)
    omega = 2.0 * np.pi * np.linspace(0.2, 8.0, 40)
    waves = np.outer(time_s, omega) + phases
    angle = 0.01 * np.sin(waves).sum(axis=1)
    velocity = 0.01 * (omega * np.cos(waves)).sum(axis=1)
    torque = -0.01 * (0.0045 * omega**2 * np.sin(waves)).sum(axis=1) + 0.137 * velocity
    torque += 1.75 * angle + 0.005 * rng.standard_normal(time_s.size)
    rows = np.column_stack([time_s, torque, angle, velocity])
    header = "time_s,torque_nm,angle_rad,velocity_rad_s"
    np.savetxt(path, rows, delimiter=",", header=header, comments="")
    return path


def test_models_of_several_epochs_are_medians_and_ranges(rigidimeter, six_epochs):
    ran = rigidimeter("model", six_epochs, "--epoch-length-s", 10)
    lines = lines_of(ran)
    assert len(lines) <= ROWS
    assert lines[0].startswith("6 epochs, ")
    (stiffness,) = (line for line in lines if line.startswith(" stiffness"))
    middle, error, low, high = map(float, re.findall(r"\d+\.\d+", stiffness))
    assert low <= middle <= high
    assert middle == pytest.approx(1.75, abs=5 * error)
    full = rigidimeter("model", six_epochs, "--epoch-length-s", 10, "--full").out
    assert full.count("inertia+damping+stiffness, VAF") == 6
    one = rigidimeter("model", six_epochs).out
    assert "--full" not in one  # of one epoch everything is shown


def test_compared_models_say_in_how_many_epochs_each_is_recommended(rigidimeter, six_epochs):
    terms = ("--terms", "inertia,damping,stiffness,coulomb", "--compare")
    lines = lines_of(rigidimeter("model", six_epochs, "--epoch-length-s", 10, *terms))
    assert len(lines) <= ROWS
    counts = {
        line.split()[0]: int(found[1])
        for line in lines
        if (found := re.search(r"(\d) of 6", line)) and line.startswith(" J+B+K")
    }
    assert set(counts) == {"J+B+K", "J+B+K+coulomb"}
    assert counts["J+B+K"] >= 5


def test_many_offsets_are_counted_and_all_are_in_full(rigidimeter, tmp_path):
    rng = np.random.default_rng(1)
    rows = ["condition,score,examiner"]
    for examiner in range(30):
        for condition, mean in (("OFF", 2.0), ("DBS", 1.5)):
            score = np.clip(round(2 * (mean + 0.5 * rng.standard_normal())) / 2, 0, 3)
            rows.append(f"{condition},{score},E{examiner}")
    (tmp_path / "r.csv").write_text("\n".join(rows) + "\n")
    lines = lines_of(rigidimeter("ratings", tmp_path / "r.csv"))
    assert len(lines) <= ROWS
    assert "30 offsets of examiner: --full" in lines
    full = rigidimeter("ratings", tmp_path / "r.csv", "--full").out
    assert len(re.findall(r"^ *E\d+ ", full, re.M)) == 30


def test_several_files_are_inspected_in_two_lines_each(rigidimeter, six_epochs, tmp_path):
    paths = [tmp_path / f"{number}.csv" for number in range(8)]
    for path in paths:
        path.write_bytes(six_epochs.read_bytes())
    ran = rigidimeter("inspect", *paths)
    assert ran.status == 0, ran.err
    lines = ran.out.rstrip("\n").split("\n")
    assert len(lines) == 16
    assert sum(line.startswith("reads it: ") for line in lines) == 8
    full = rigidimeter("inspect", *paths, "--full").out
    assert full.count("torque_nm") >= 8 > ran.out.count("torque_nm")
