"""`--leave-out`: what the user wrote reaches the epoch that holds it, with its reason."""

import json

import numpy as np
import pytest

from rigidimeter.analysis.reading import read
from rigidimeter.analysis.reading.leave_out import parse_left_out
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import LeftOut


def write(path, start_s=0.0, push_nm=0.0):
    """Write 40 s of a joint that is moved, with a push of 2 s at 32 s."""
    time_s = start_s + np.arange(0.0, 40.0, 0.01)
    w = 2 * np.pi * np.array([0.31, 0.73, 1.51, 3.13, 6.07])
    phase = np.outer(time_s - start_s, w) + np.arange(w.size) ** 2
    angle = (0.03 / w * np.sin(phase)).sum(1)
    velocity = (0.03 * np.cos(phase)).sum(1)
    acceleration = (-0.03 * w * np.sin(phase)).sum(1)
    torque = 0.005 * acceleration + 0.14 * velocity + 1.8 * angle
    torque += 1e-4 * np.random.default_rng(1).standard_normal(time_s.size)
    torque += push_nm * (abs(time_s - start_s - 33.0) < 1.0)
    columns = np.column_stack([time_s, torque, angle, velocity])
    head = "time_s,torque_nm,angle_rad,velocity_rad_s"
    np.savetxt(path, columns, delimiter=",", header=head, comments="", fmt="%.9g")
    return path


@pytest.mark.parametrize(
    ("text", "name", "stretch"),
    [
        ("12.3:14.0", "", LeftOut(12.3, 14.0)),
        ("12.3:14.0 cough", "", LeftOut(12.3, 14.0, "cough")),
        ("day 1=-1:2 he said: K=3", "day 1", LeftOut(-1.0, 2.0, "he said: K=3")),
        ("1e1:2e1  two  words ", "", LeftOut(10.0, 20.0, "two  words")),
    ],
)
def test_what_can_be_written(text, name, stretch):
    assert parse_left_out(text)[1:] == (name, stretch)


@pytest.mark.parametrize("text", ["", "12", "14:12", "3:3", "a:b", "12:nan", "=1:2", "1:2cough"])
def test_what_cannot_be_is_refused_with_an_example(text):
    with pytest.raises(UserError, match="--leave-out"):
        parse_left_out(text)


def test_it_reaches_the_epoch_that_holds_it(tmp_path):
    one, two = write(tmp_path / "one.csv"), write(tmp_path / "two.csv", start_s=100.0)
    both = read([one, two], epoch_length_s=20.0, leave_out=["two=132:134 push", "one.csv=19:21"])
    assert [epoch.left_out for epoch in both.epochs] == [
        (LeftOut(19.0, 21.0),),
        (LeftOut(19.0, 21.0),),
        (),
        (LeftOut(132.0, 134.0, "push"),),
    ]
    said = [notice.text for notice in both.notices if "left out" in notice.text]
    assert f"{two}, epoch 2: 132 to 134 s are left out: push" in said
    assert not both.failed


def test_what_means_no_recording_or_no_epoch_is_refused(tmp_path):
    one, two = write(tmp_path / "one.csv"), write(tmp_path / "two.csv")
    for leave_out, said in (
        (["1:2"], "say which"),
        (["three=1:2"], "no recording is called three"),
        (["one=41:42"], "lies in no epoch of .*from 0 to 39.99 s"),
    ):
        with pytest.raises(UserError, match=said):
            read([one, two], leave_out=leave_out)


def test_an_estimate_without_the_push_is_the_joint_and_says_why(rigidimeter, tmp_path):
    path, out = write(tmp_path / "one.csv", push_nm=0.05), tmp_path / "estimates.json"
    ran = rigidimeter("estimate", path, "--leave-out", "32:34 push", "--full", "--json", out)
    assert ran.status == 0, ran.err
    assert "epoch 1: 32 to 34 s are left out: push" in ran.err
    assert "left_out 2 s were left out by hand; epoch 1" in " ".join(ran.out.split())
    (epoch,) = json.loads(out.read_text())["epochs"]
    (found,) = (each for each in epoch["findings"] if each["name"] == "left_out")
    assert "from 32 to 34 s: push" in found["details"]
    assert epoch["stiffness_nm_rad"] == pytest.approx(1.8, rel=0.005)
    assert epoch["inertia_kg_m2"] == pytest.approx(0.005, rel=0.01)


def test_an_epoch_that_is_left_out_whole_is_excluded_and_no_error(rigidimeter, tmp_path):
    path, out = write(tmp_path / "one.csv"), tmp_path / "estimates.json"
    halves = "--epoch-length-s", "20"
    ran = rigidimeter(
        "estimate", path, *halves, "--leave-out", "0.01:20 cough (Kim)", "--json", out
    )
    assert ran.status == 0, ran.err
    assert "epoch 1 is left out: cough (Kim)" in ran.err
    first, second = json.loads(out.read_text())["epochs"]
    assert (first["outcome"], first["reason"]) == ("excluded", "left out: cough (Kim)")
    assert second["outcome"] == "included"


def test_a_study_folder_has_its_own_list(rigidimeter, tmp_path):
    (tmp_path / "study.toml").write_text("")
    ran = rigidimeter("compare", tmp_path, "--leave-out", "1:2")
    assert ran.status != 0
    assert "--leave-out: is for single recordings" in ran.err
