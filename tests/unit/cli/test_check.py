"""`rigidimeter check`: what is refused before anything is connected."""

from __future__ import annotations

import math

import pytest

from rigidimeter.rig.acquisition import replay_session
from rigidimeter.rig.guard import guard_limits

HARDWARE = """
[torque_sensor]
driver = "ati-rdt"
address = "192.0.2.1"
[drive]
driver = "ascii"
port = "/dev/no-such"
counts_per_turn = 1000
"""
EMULATED = HARDWARE.replace("192.0.2.1", "127.0.0.1").replace("/dev/no-such", "/dev/pts/99")


@pytest.fixture
def rig(tmp_path):
    path = tmp_path / "RIG.toml"
    path.write_text(EMULATED)
    return path


@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf"])
def test_a_known_inertia_must_be_above_zero(rig, rigidimeter, value):
    ran = rigidimeter("check", rig, "--yes", "--known-inertia-kg-m2", value)
    assert ran.status == 1
    finite = math.isfinite(float(value))
    wrong = "must be a number above 0" if finite else "is not a number of kg·m², such as 10"
    assert f"--known-inertia-kg-m2 {float(value):g}: {wrong}" in ran.err


def test_a_flag_does_not_look_whether_an_arm_is_in_hardware(rig, rigidimeter):
    rig.write_text(HARDWARE)
    ran = rigidimeter("check", rig, "--yes")
    assert ran.status == 1
    assert "is real hardware; somebody must check" in ran.err


def test_somebody_must_answer(rig, rigidimeter):
    ran = rigidimeter("check", rig)
    assert ran.status == 1
    assert "nobody can answer the question" in ran.err


def test_the_rig_is_commissioned_first(rig, rigidimeter):
    ran = rigidimeter("check", rig, "--yes")
    assert ran.status == 1
    assert "there is no such record; make it with `rigidimeter commission`" in ran.err
    assert not rig.with_name("RIG.checked.json").exists()


def test_a_damaged_reference_is_given_up_knowingly(rig, rigidimeter, monkeypatch):
    monkeypatch.setattr("rigidimeter.rig.commissioning.check_record", lambda *_: None)
    rig.with_name("RIG.checked.json").write_text("{}")
    ran = rigidimeter("check", rig, "--yes")
    assert ran.status == 1
    assert (
        "is no daily check of the schema rigidimeter.check/1; its reference is lost, so add"
        in ran.err
    )


def test_live_readings_need_a_rig(rigidimeter):
    ran = rigidimeter("check", "--live")
    assert ran.status == 1
    assert "--live need a RIG.toml" in ran.err


def test_a_session_is_replayed_and_what_came_of_it_is_shown(recorded, rigidimeter):
    ran = rigidimeter("check", "--replay", recorded())
    assert ran.status == 0
    assert "times real time" in ran.out
    assert "The guard stopped or held for: nothing." in ran.out
    assert "Commands: the same to the bit." in ran.out
    assert "Same causes and limits at the same ticks as in the record." in ran.out


def test_another_guard_is_a_failure_that_says_where(recorded, rigidimeter, monkeypatch):
    def slow(settings):
        return guard_limits(settings)._replace(speed_rad_s=0.1)

    monkeypatch.setitem(replay_session.__globals__, "guard_limits", slow)
    ran = rigidimeter("check", "--replay", recorded())
    assert ran.status == 1
    assert "First differences:" in ran.out
    assert "limit NOT in the record, SPEED in the replay" in ran.out
    assert "the guard of this version differs from the record in" in ran.err


def test_a_session_of_which_nothing_is_left_is_no_success(recorded, rigidimeter):
    folder = recorded()
    samples = folder / "samples.arrows"
    samples.write_bytes(samples.read_bytes()[:2000])
    ran = rigidimeter("check", "--replay", folder)
    assert (ran.status, ran.out) == (1, "")
    assert "no tick can be replayed: the end of samples.arrows is damaged or missing" in ran.err


@pytest.mark.parametrize("also", [["RIG.toml"], ["--zero"], ["--settings", "other.toml"]])
def test_a_replay_goes_alone(recorded, rigidimeter, also):
    ran = rigidimeter("check", *also, "--replay", recorded())
    assert ran.status == 1
    assert "--replay SESSION goes alone" in ran.err
