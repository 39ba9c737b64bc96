"""What is left of a session, where its joint stood, and on which rig it may go on."""

from __future__ import annotations

from dataclasses import asdict

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import SessionWriter, rest_of
from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan

SETTINGS = parse_settings({"protocol": {"blocks": [{"epochs": 3}], "rests_s": [4.0]}})
EPOCHS = plan(SETTINGS.protocol, SETTINGS.prbs, SETTINGS.sinusoid, 1).epochs


@pytest.fixture
def session(tmp_path):
    """Make a session folder in which the first `done` epochs ended with success."""

    def make(name, *, done=1, origin_rad=None, virtual=False, continues=None, closed=True):
        folder = tmp_path / name
        planned = [asdict(epoch) for epoch in EPOCHS]
        writer = SessionWriter(
            folder, SETTINGS, planned, {"session": 1}, virtual=virtual, continues=continues
        )
        writer.event("session_started", time_s=0.0)
        if origin_rad is not None:
            writer.event("rig_enabled", time_s=0.0, origin_rad=origin_rad)
        for epoch in EPOCHS[:done]:
            named = {"label": epoch.label, "task": epoch.task, "condition": epoch.condition}
            writer.event("epoch_started", epoch=epoch.number, **named, time_s=0.0)
            ending = {"time_s": 1.0, "outcome": "success", "reason": ""}
            writer.event("epoch_ended", epoch=epoch.number, **ending)
        if closed:
            writer.close(1.0, "abort", "aborted by the operator")
        else:
            writer.close_files()
        return folder

    return make


def test_what_was_not_run_to_its_end_is_left(session):
    rest = rest_of(session("s", done=1))
    assert rest.epochs == EPOCHS[1:]
    assert rest.done == 1
    assert rest.settings == SETTINGS


def test_an_epoch_whose_repetition_is_done_is_done(tmp_path):
    writer = SessionWriter(tmp_path / "s", SETTINGS, [asdict(e) for e in EPOCHS], {}, virtual=True)
    for number, outcome, more in ((1, "abort", {"again_as": 4}), (4, "success", {})):
        writer.event("epoch_ended", epoch=number, time_s=1.0, outcome=outcome, reason="", **more)
    writer.close(1.0, "abort", "aborted by the operator")
    assert rest_of(tmp_path / "s").epochs == EPOCHS[1:]


@pytest.mark.parametrize(
    ("why", "reason", "left"),
    [
        ("the guard stopped the rig: stall", "the guard stopped the rig: still for 41 ms", 0),
        ("the arm came to the position limit", "the guard stopped the rig: stall", 1),
        ("the guard stopped the rig: torque", "aborted by the operator", 1),
        ("killed", "killed", 0),
    ],
)
def test_the_epoch_in_which_the_session_was_stopped_is_run_again(tmp_path, why, reason, left):
    """One that failed before the session went on would fail again."""
    writer = SessionWriter(tmp_path / "s", SETTINGS, [asdict(e) for e in EPOCHS], {}, virtual=True)
    writer.event("epoch_ended", epoch=1, time_s=1.0, outcome="fail", reason=why)
    writer.close(1.0, "fail", reason)
    assert rest_of(tmp_path / "s").epochs == EPOCHS[left:]


@pytest.mark.parametrize("closed", [True, False])
def test_it_goes_on_from_where_the_joint_stood(session, closed):
    rest = rest_of(session("s", origin_rad=-0.25, closed=closed))
    assert rest.continues["folder"] == "s"
    assert rest.continues["origin_rad"] == -0.25


def test_a_rig_that_was_never_enabled_stood_nowhere(session):
    assert "origin_rad" not in rest_of(session("s", done=0)).continues


def test_the_place_of_the_first_session_counts(session):
    """Within 3 deg each time, the limits would else move on with every session."""
    first = rest_of(session("one", origin_rad=0.10))
    second = rest_of(session("two", origin_rad=0.14, continues=first.continues))
    assert second.continues["origin_rad"] == 0.10


def test_a_session_that_ended_before_it_was_enabled_hands_the_place_on(session):
    first = rest_of(session("one", origin_rad=0.10))
    second = rest_of(session("two", done=0, continues=first.continues))
    assert second.continues["origin_rad"] == 0.10


@pytest.fixture
def no_session(monkeypatch):
    def supervise(*_, **__):
        raise AssertionError("a session was started")

    monkeypatch.setattr("rigidimeter.rig.acquisition.processes.supervise", supervise)


@pytest.mark.usefixtures("no_session")
def test_a_virtual_session_does_not_go_on_on_a_real_rig(session, rigidimeter, tmp_path):
    folder = session("s", virtual=True)
    rig = tmp_path / "rig.toml"
    ran = rigidimeter("run", "--resume", folder, "--rig", rig, "--out", tmp_path / "n")
    assert ran.status != 0
    assert f"{folder}: was recorded on the virtual rig and can only be continued there" in ran.err
    assert not (tmp_path / "n").exists()


@pytest.mark.usefixtures("no_session")
def test_a_real_session_does_not_go_on_on_the_virtual_rig(session, rigidimeter, tmp_path):
    folder = session("s", virtual=False)
    ran = rigidimeter("run", "--resume", folder, "--out", tmp_path / "n")
    assert ran.status != 0
    assert "was recorded on hardware and can only be continued there; name its rig file" in ran.err
    assert not (tmp_path / "n").exists()


@pytest.mark.usefixtures("no_session")
@pytest.mark.parametrize(("virtual", "option"), [(True, ""), (False, " --rig RIG.toml")])
def test_the_way_on_is_offered(session, rigidimeter, virtual, option):
    folder = session("s", virtual=virtual)
    ran = rigidimeter("run", "--out", folder)
    assert ran.status != 0
    assert f"rigidimeter run --resume {folder}{option} --out {folder}-2`" in ran.err


def test_a_session_without_a_protocol_cannot_go_on(tmp_path):
    SessionWriter(tmp_path / "s", SETTINGS, [], {}, virtual=True).close(0.0, "fail", "")
    with pytest.raises(UserError, match="no protocol, so it cannot be"):
        rest_of(tmp_path / "s")


def test_what_was_said_of_the_subject_goes_on(tmp_path):
    about = {"subject": "S01", "stimulation": {"frequency_hz": 130.0}, "blinded": True}
    planned = [asdict(epoch) for epoch in EPOCHS]
    writer = SessionWriter(tmp_path / "s", SETTINGS, planned, {}, virtual=True, about=about)
    writer.close(1.0, "abort", "aborted by the operator")
    assert rest_of(tmp_path / "s").about == about


@pytest.mark.parametrize("counted", [True, False])
def test_what_a_session_has_done_is_passed_on_to_the_one_that_continues_it(tmp_path, counted):
    """That of its last epoch, which holds what came before; else that of the session before."""
    before = {"epochs": 4, "motion_s": 80.0, "arrivals": 1}
    planned = [asdict(epoch) for epoch in EPOCHS]
    continues = {"dose": before}
    writer = SessionWriter(tmp_path / "s", SETTINGS, planned, {}, virtual=True, continues=continues)
    done = {"epochs": 5, "motion_s": 103.0, "arrivals": 1}
    if counted:
        ending = {"time_s": 1.0, "outcome": "success", "reason": "", "dose": done}
        writer.event("epoch_ended", epoch=1, **ending)
    writer.close(1.0, "abort", "aborted by the operator")
    assert rest_of(tmp_path / "s").continues["dose"] == (done if counted else before)


def test_a_session_of_before_counts_no_dose(session):
    assert "dose" not in rest_of(session("s")).continues
