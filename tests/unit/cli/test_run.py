"""`rigidimeter run`: what is refused before it starts, what it is told, how it ends."""

from __future__ import annotations

import math
import os
import re
import signal
from dataclasses import asdict
from types import SimpleNamespace

import pytest

from rigidimeter.cli.attendance import attendance
from rigidimeter.cli.page_session import lead_session
from rigidimeter.cli.planned_session import PlannedSession, checked_rig
from rigidimeter.cli.realtime_rig import HOME_TOLERANCE_RAD
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import SessionWriter
from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition.processes import EndedEarly, Realtime
from rigidimeter.rig.console.page import Place, ServerState, StartRequest
from rigidimeter.rig.devices import STOP_HIGH, STOP_LOW, Home, RigFile, load_rig

RIG = """
home_deg = 10.0
[torque_sensor]
driver = "ati-rdt"
address = "127.0.0.1"
[drive]
driver = "ascii"
port = "/dev/no-such"
counts_per_turn = 1000
"""


CHECKED = SimpleNamespace(reference=None, numbers={})


class BuiltError(Exception):
    """The rig would be connected next."""


@pytest.fixture(autouse=True)
def _own_locks(tmp_path_factory, monkeypatch):
    """The rigs of these tests are not those of another run of them on this machine."""
    folder = tmp_path_factory.mktemp("locks")
    folder.chmod(0o1777)
    monkeypatch.setattr("rigidimeter.rig.devices.rig_lock.FOLDERS", (folder,))


@pytest.fixture
def seen(monkeypatch):
    """Run the loop's target in this process up to where the rig is made; keep what was told."""
    seen = SimpleNamespace(home=None, continues=None, about=None, bounds=None)

    def build(_, now, tick_rate_hz, home=None, lock=None, bounds=None):
        seen.home, seen.bounds = home, bounds
        raise BuiltError

    def supervise(target, recording, **_):
        seen.continues, seen.about = recording.continues, recording.about
        seen.settings = recording.settings
        target(SimpleNamespace())

    monkeypatch.setattr(RigFile, "build", build)
    numbers = {STOP_LOW: -45.0, STOP_HIGH: 90.0}
    seen.commissioned = commissioned = SimpleNamespace(rig_name="rig", numbers=numbers)
    monkeypatch.setattr("rigidimeter.cli.planned_session.check_record", lambda *_: commissioned)
    monkeypatch.setattr(
        "rigidimeter.cli.planned_session.require_daily_check", lambda *_, **__: CHECKED
    )
    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", supervise)
    return seen


@pytest.fixture
def resume(tmp_path, rigidimeter):
    """Go on with a session that noted this origin, on a rig whose file names another home."""

    def run(origin_rad, *options, about=None, rig_text=f"absolute_angle = true\n{RIG}"):
        settings = parse_settings({})
        epochs = plan(settings.protocol, settings.prbs, settings.sinusoid, 1).epochs
        planned = [asdict(epoch) for epoch in epochs]
        writer = SessionWriter(
            tmp_path / "s", settings, planned, {}, virtual=False, about=about or {}
        )
        if origin_rad is not None:
            writer.event("rig_enabled", time_s=0.0, origin_rad=origin_rad)
        writer.close(0.0, "abort", "aborted by the operator")
        rig = tmp_path / "rig.toml"
        rig.write_text(rig_text)
        return rigidimeter(
            *("run", "--resume", tmp_path / "s", "--rig", rig, "--out", tmp_path / "n"),
            *("--unattended", "--confirm", "nobody in the rig", *options),
        )

    return run


def test_the_home_is_where_the_session_began(seen, resume):
    with pytest.raises(BuiltError):
        resume(0.25, *RANGE)
    assert seen.home == Home(0.25, HOME_TOLERANCE_RAD)
    assert seen.continues["origin_rad"] == 0.25


def test_a_session_with_nobody_in_the_rig_is_recorded_as_one_without_a_subject(seen, resume):
    with pytest.raises(BuiltError):
        resume(0.25, *RANGE)
    assert not seen.settings.diagnostics.subject_present
    assert parse_settings({}).diagnostics.subject_present


def test_a_session_that_began_nowhere_leaves_the_home_to_the_rig_file(seen, resume):
    with pytest.raises(BuiltError):
        resume(None, *RANGE)
    assert seen.home is None
    assert "origin_rad" not in seen.continues


RANGE = ("--range-deg", "-30", "60")


def test_a_range_that_is_typed_goes_to_the_record_and_to_the_drive(seen, resume):
    with pytest.raises(BuiltError):
        resume(0.25, *RANGE, about={"subject": "S01"})
    assert seen.about["range"] == {
        "low_deg": -30.0,
        "high_deg": 60.0,
        "how": "typed",
        "subject": "S01",
    }
    assert seen.bounds.range_rad == pytest.approx((math.radians(-30.0), math.radians(60.0)))


def test_a_session_goes_on_within_its_own_range_and_says_whose_it_is(seen, resume, capsys):
    kept = {"low_deg": -20.0, "high_deg": 50.0, "how": "led by hand", "subject": "S01"}
    with pytest.raises(BuiltError):
        resume(0.25, about={"subject": "S01", "range": kept})
    assert seen.about["range"] == kept


@pytest.mark.parametrize(
    ("options", "about", "rig_text", "told"),
    [
        ((), {}, None, "is hardware, so the range of motion of this person is needed"),
        (("--range-deg", "60", "-30"), {}, None, "must go from a lower to a higher angle"),
        (("--range-deg", "-44", "60"), {}, None, "must be inside -42 to 87 deg"),
        ((*RANGE, "--lead-range"), {}, None, "two ways to say one thing"),
        (RANGE, {}, RIG, "does not say absolute_angle = true"),
        ((), {"range": {"low_deg": 1.0}}, None, "in its manifest cannot be read"),
        (
            (),
            {
                "subject": "S02",
                "range": {"low_deg": -20.0, "high_deg": 50.0, "how": "typed", "subject": "S01"},
            },
            None,
            "range of motion of S01, and the subject is S02",
        ),
    ],
)
def test_hardware_is_refused_without_a_range_that_holds(
    seen, resume, options, about, rig_text, told
):
    more = {} if rig_text is None else {"rig_text": rig_text}
    ended = resume(0.25, *options, about=about, **more)
    assert ended.status != 0
    assert told in " ".join(ended.err.split())
    assert seen.bounds is None


def test_a_record_without_the_angles_of_the_stops_is_refused(seen, resume):
    seen.commissioned.numbers.clear()
    ended = resume(0.25, *RANGE)
    assert "has no angles of the mechanical stops" in " ".join(ended.err.split())


EMULATED = """
[torque_sensor]
driver = "ati-rdt"
address = "127.0.0.1"
[drive]
driver = "cia402"
interface = "virtual"
channel = "test"
"""


@pytest.mark.parametrize(
    ("rig", "terminal", "options", "there"),
    [
        (None, False, {}, (False, "")),
        (None, True, {}, (True, "")),
        (None, True, {"unattended": True}, (False, "")),
        (EMULATED, False, {}, (False, "")),
        (EMULATED, False, {"unattended": True}, (False, "")),
        (RIG, True, {}, (True, "")),
        (RIG, False, {}, "the input is no terminal, so nobody could stop it"),
        (RIG, False, {"unattended": True}, '--unattended needs --confirm "nobody in the rig"'),
        (RIG, False, {"unattended": True, "confirm": "yes"}, "not 'yes', and that it is so"),
        (
            RIG,
            False,
            {"unattended": True, "confirm": "Nobody  in the rig"},
            (False, "nobody in the rig"),
        ),
        (RIG, True, {"confirm": "nobody in the rig"}, "goes with --unattended alone"),
    ],
)
def test_hardware_moves_with_somebody_there_or_where_it_is_written_that_nobody_is_in_it(
    tmp_path, monkeypatch, rig, terminal, options, there
):
    monkeypatch.setattr("rigidimeter.cli.attendance.at_terminal", lambda: terminal)
    path = None
    if rig is not None:
        path = tmp_path / "rig.toml"
        path.write_text(rig)
    asked = {"unattended": False, "confirm": "", **options}
    if isinstance(there, str):
        with pytest.raises(UserError, match=re.escape(there)):
            attendance(path, **asked)
    else:
        assert attendance(path, **asked) == there


@pytest.mark.parametrize("typed", ["nobody in the rig", "n"])
def test_at_a_terminal_it_is_typed(tmp_path, monkeypatch, typed):
    monkeypatch.setattr("rigidimeter.cli.attendance.at_terminal", lambda: True)
    monkeypatch.setattr("typer.prompt", lambda *_, **__: typed)
    path = tmp_path / "rig.toml"
    path.write_text(RIG)
    if typed == "n":
        with pytest.raises(UserError, match="and that it is so"):
            attendance(path, unattended=True, confirm="")
    else:
        assert attendance(path, unattended=True, confirm="") == (False, "nobody in the rig")


@pytest.mark.parametrize(("outcome", "status"), [("success", 0), ("fail", 1)])
def test_a_run_ends_with_1_where_a_planned_epoch_has_no_success(
    tmp_path, monkeypatch, rigidimeter, outcome, status
):
    """The second epoch ended like this; the session as a whole went to its end."""
    settings = parse_settings({})
    planned = plan(settings.protocol, settings.prbs, settings.sinusoid, 1).epochs[:2]
    writer = SessionWriter(tmp_path / "s", settings, list(map(asdict, planned)), {}, virtual=True)
    for epoch, ending in zip(planned, ("success", outcome), strict=True):
        ended = {"time_s": 1.0, "outcome": ending, "reason": ""}
        writer.event("epoch_ended", epoch=epoch.number, **ended)
    writer.close(1.0, "success", "")
    result = SimpleNamespace(folder=tmp_path / "s", outcome="success", reason="", remarks=())
    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", lambda *_, **__: result)
    ran = rigidimeter("run", "--out", tmp_path / "new", "--unattended")
    assert ran.status == status
    assert f"{2 - status} of 2 epochs completed" in ran.out
    assert ("1 of 2 epochs did not end with success" in ran.err) == (status == 1)


def test_a_rig_without_a_record_is_refused_before_any_process_starts(
    tmp_path, monkeypatch, rigidimeter
):
    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", None)
    rig = tmp_path / "rig.toml"
    rig.write_text(RIG)
    result = rigidimeter("run", "--rig", rig, "--out", tmp_path / "s")
    assert result.status == 1
    assert "rigidimeter commission" in result.err
    assert not (tmp_path / "s").exists()


def test_a_rig_that_was_not_checked_today_is_refused_with_the_command_to_type(
    tmp_path, monkeypatch, rigidimeter
):
    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", None)
    numbers = {STOP_LOW: -45.0, STOP_HIGH: 90.0}
    seen.commissioned = commissioned = SimpleNamespace(rig_name="rig", numbers=numbers)
    monkeypatch.setattr("rigidimeter.cli.planned_session.check_record", lambda *_: commissioned)
    rig, protocol = tmp_path / "rig.toml", tmp_path / "protocol.toml"
    rig.write_text(RIG)
    protocol.write_text("seed = 2\n")
    result = rigidimeter("run", protocol, "--rig", rig, "--out", tmp_path / "s")
    assert result.status == 1
    command = f"`rigidimeter check {rig} --settings {protocol}`"
    assert f"rig.checked.json: there is no such record; make it with {command}" in result.err
    assert not (tmp_path / "s").exists()


def test_a_rig_that_another_uses_is_refused_before_any_process_starts(
    tmp_path, monkeypatch, rigidimeter
):
    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", None)
    numbers = {STOP_LOW: -45.0, STOP_HIGH: 90.0}
    seen.commissioned = commissioned = SimpleNamespace(rig_name="rig", numbers=numbers)
    monkeypatch.setattr("rigidimeter.cli.planned_session.check_record", lambda *_: commissioned)
    monkeypatch.setattr(
        "rigidimeter.cli.planned_session.require_daily_check", lambda *_, **__: CHECKED
    )
    rig, copy = tmp_path / "rig.toml", tmp_path / "copy.toml"
    rig.write_text(RIG)
    copy.write_text(f'name = "a copy"\n{RIG}')
    with load_rig(rig).claim():
        result = rigidimeter("run", "--rig", copy, "--out", tmp_path / "s")
    assert result.status == 1
    assert f"another program uses this rig (process {os.getpid()})" in result.err
    assert not (tmp_path / "s").exists()


def test_a_session_that_still_runs_is_not_gone_on_with(tmp_path, monkeypatch, rigidimeter):
    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", None)
    settings = parse_settings({})
    epochs = plan(settings.protocol, settings.prbs, settings.sinusoid, 1).epochs
    planned = [asdict(epoch) for epoch in epochs]
    running = SessionWriter(tmp_path / "s", settings, planned, {}, virtual=True)
    result = rigidimeter("run", "--resume", tmp_path / "s", "--out", tmp_path / "n")
    running.close(0.0, "abort", "aborted by the operator")
    assert result.status == 1
    assert "s: is still being recorded; end that session first" in result.err
    assert not (tmp_path / "n").exists()


def test_a_page_is_for_a_new_session_with_an_operator(tmp_path, rigidimeter):
    result = rigidimeter("run", "--out", tmp_path / "s", "--console", "--unattended")
    assert result.status == 1
    assert "--console goes with neither --unattended nor --resume" in result.err


@pytest.mark.parametrize("ends", [("10", "40"), ("-40", "0")])
def test_a_range_without_the_start_is_refused_on_the_virtual_rig_too(
    tmp_path, monkeypatch, rigidimeter, ends
):
    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", None)
    result = rigidimeter("run", "--out", tmp_path / "s", "--range-deg", *ends)
    assert result.status == 1
    assert "the joint of the virtual rig stands at 0 deg, which must be between both" in result.err
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--range-deg", "-30", "60"), "--range-deg does not go with --console"),
        (("--lead-range",), "--lead-range does not go with --console"),
        (("--blinded",), "--blinded does not go with --console"),
        (("--confirm", "nobody in the rig"), "--confirm does not go with --console"),
    ],
)
def test_what_the_form_asks_for_is_not_passed_over_among_the_options(
    tmp_path, monkeypatch, rigidimeter, options, words
):
    monkeypatch.setattr("rigidimeter.cli.page_session.serve_page", None)
    result = rigidimeter("run", "--out", tmp_path / "s", "--console", *options)
    assert result.status == 1
    assert words in result.err


def test_a_session_on_the_page_runs_only_while_the_page_is_there(tmp_path, monkeypatch):
    told = {}

    def supervise(target, recording, **options):
        told.update(options)
        raise UserError("that is enough")

    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", supervise)
    settings = parse_settings({})
    state = ServerState(Place(tmp_path, settings, "the defaults"))
    assert lead_session(state, StartRequest("s", settings), Realtime(), lambda: None) is None
    assert told["operator_seen_ns"] == state.operator_seen_ns
    assert state.finished.sentences == ("that is enough",)


def test_a_signal_while_the_source_of_emg_is_awaited_ends_the_program_of_the_page(
    tmp_path, monkeypatch
):
    def supervise(*_, **__):
        raise EndedEarly("it was ended while the session waited", [signal.SIGTERM])

    monkeypatch.setattr("rigidimeter.cli.planned_session.supervise", supervise)
    settings = parse_settings({})
    state = ServerState(Place(tmp_path, settings, "the defaults"))
    assert lead_session(state, StartRequest("s", settings), Realtime(), lambda: None) is None
    assert state.ending


def test_a_protocol_beyond_the_dose_of_a_session_is_refused_before_any_process_starts(
    tmp_path, rigidimeter
):
    protocol = tmp_path / "long.toml"
    protocol.write_text("[dose]\nepochs = 3\n[[protocol.blocks]]\nepochs = 4\n")
    ran = rigidimeter("run", protocol, "--out", tmp_path / "s")
    assert ran.status == 1
    assert "long.toml: the protocol has 4 epochs, more than dose.epochs = 3" in ran.err
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize(("epochs", "words"), [(2, ""), (3, "3 epochs were run, the most of one")])
def test_a_session_is_continued_until_its_dose_is_reached(tmp_path, epochs, words):
    settings = parse_settings({"dose": {"epochs": 3}})
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, 1)
    continues = {"dose": {"epochs": epochs, "motion_s": 0.0, "arrivals": 0}}
    planned = PlannedSession(settings, protocol, continues=continues)
    if words:
        with pytest.raises(UserError, match=words):
            checked_rig(planned, None)
    else:
        assert checked_rig(planned, None).protocol == protocol
