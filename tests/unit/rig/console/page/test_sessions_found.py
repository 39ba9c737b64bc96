"""The sessions of a folder, and epochs that are left out of results."""

import json
import re
from dataclasses import asdict

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import SessionWriter, again, read_manifest
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.console.page import epoch_panes, exclude, found_sessions, include

EXCLUSIONS = "exclusions.csv"
TWICE = parse_settings({"protocol": {"blocks": [{"epochs": 4}], "rests_s": [4.0]}})


@pytest.fixture
def root(simulate, tmp_path):
    simulate(epochs=2, name="S01-1")
    return tmp_path


def test_a_session_is_found_with_its_epochs(root):
    (root / "other").mkdir()
    (found,), problems = found_sessions(root)
    assert problems == []
    assert (found.name, found.outcome, found.good, found.planned) == ("S01-1", "success", 2, 2)
    assert [epoch.label for epoch in found.epochs] == ["1", "2"]
    assert not found.recording


def test_an_interrupted_session_and_one_that_is_recorded_are_told_apart(tmp_path):
    about = {"subject": "S02", "blinded": True, "codes": {"DBS": "code-B"}}
    writer = SessionWriter(tmp_path / "s", Settings(), [], {}, virtual=True, about=about)
    begun = {"label": "1", "task": "prbs", "condition": "DBS", "time_s": 0.0}
    writer.event("epoch_started", epoch=1, **begun)
    writer.event("note", what="rating", epoch=1, score=1.5, by="E1")
    (found,), _ = found_sessions(tmp_path)
    assert found.recording
    writer.close_files()
    (found,), _ = found_sessions(tmp_path)
    assert (found.recording, found.outcome, found.reason) == (False, "", "it was interrupted")
    assert found.subject == "S02"
    assert found.epochs[0].condition == "code-B"
    assert found.options == ("--blinded",)
    assert found.epochs[0].rating == "1.5 (E1)"


def test_an_epoch_is_left_out_with_a_reason_and_a_name_and_nothing_deleted(root):
    before = {path: path.read_bytes() for path in (root / "S01-1").iterdir()}
    exclude(root, "S01-1", "2", "=cough, twice", "Op")
    (found,), _ = found_sessions(root)
    assert [epoch.excluded for epoch in found.epochs] == ["", "=cough, twice (Op)"]
    exclude(root, "S01-1", "1", "moved", "Op")
    assert (root / EXCLUSIONS).read_text().splitlines()[1:] == [
        "path,epoch,reason,by",
        'S01-1,2,"\'=cough, twice",Op',
        "S01-1,1,moved,Op",
    ]
    assert before == {path: path.read_bytes() for path in (root / "S01-1").iterdir()}
    with pytest.raises(UserError, match="left out already"):
        exclude(root, "S01-1", "2", "again", "Op")


@pytest.mark.usefixtures("no_figures")
def test_what_is_estimated_from_the_page_is_without_the_epochs_left_out(root, rigidimeter):
    (found,), _ = found_sessions(root)
    assert found.options == ()
    exclude(root, "S01-1", "2", "cough", "Op")
    (found,), _ = found_sessions(root)
    out = root / "e.json"
    assert rigidimeter("estimate", root / "S01-1", "--json", out, *found.options).status == 0
    one, two = json.loads(out.read_text())["epochs"]
    assert (one["outcome"], two["outcome"]) == ("included", "excluded")
    ran = rigidimeter("report", root / "S01-1", "--out", root / "page", *found.options)
    assert ran.status == 0
    assert "epoch 2 is left out: cough (Op)" in ran.err


@pytest.mark.parametrize(
    ("session", "epoch", "reason", "by", "said"),
    [
        ("../x", "1", "r", "b", "session: '../x' is not allowed"),
        ("S01-1", "9", "r", "b", "has no epoch 9"),
        ("S01-1", "1", " ", "b", "give a reason"),
        ("S01-1", "1", "r", "", "give a reason"),
        ("S01-1", "1", "two\nlines", "b", "cannot be shown"),
    ],
)
def test_bad_exclusions_are_refused(root, session, epoch, reason, by, said):
    with pytest.raises(UserError, match=said):
        exclude(root, session, epoch, reason, by)
    assert not (root / EXCLUSIONS).exists()


def test_a_table_as_a_spreadsheet_left_it_keeps_its_form_and_its_comments(root):
    before = "\ufeffpath;epoch;reason;note;by\r\n# Müller asked\r\nS01-1;1;moved;n;Op"
    (root / EXCLUSIONS).write_bytes(before.encode())
    exclude(root, "S01-1", "2", "cough; twice", "Op")
    after = (root / EXCLUSIONS).read_bytes().decode()
    assert after == before + '\r\nS01-1;2;"cough; twice";;Op\r\n'
    (found,), problems = found_sessions(root)
    assert [epoch.excluded for epoch in found.epochs] == ["moved (Op)", "cough; twice (Op)"]
    assert problems == []


def test_an_epoch_that_is_included_again_leaves_who_when_and_why(root):
    exclude(root, "S01-1", "2", 'a "cough", twice', "Op")
    exclude(root, "S01-1", "1", "moved", "Op")
    include(root, "S01-1", "2", "it was in the rest", "Kim")
    (found,), problems = found_sessions(root)
    assert ([epoch.excluded for epoch in found.epochs], problems) == (["moved (Op)", ""], [])
    *_, trace, kept = (root / EXCLUSIONS).read_text().splitlines()
    assert kept == "S01-1,1,moved,Op"
    assert re.fullmatch(
        r"# included again \d{4}-\d\d-\d\d \d\d:\d\d UTC by Kim \(it was in the rest\): "
        r'S01-1,2,"a ""cough"", twice",Op',
        trace,
    )
    with pytest.raises(UserError, match="epoch 2 of S01-1 is not left out"):
        include(root, "S01-1", "2", "r", "b")
    with pytest.raises(UserError, match="give a reason and your name"):
        include(root, "S01-1", "1", "r", " ")
    exclude(root, "S01-1", "2", "once more", "Op")
    assert [epoch.excluded for epoch in found_sessions(root)[0][0].epochs][1] == "once more (Op)"


def test_including_again_keeps_the_rest_of_a_spreadsheets_table(root):
    rows = ["path;epoch;reason;by", "# Müller", 'S01-1;1;"two\nlines";Op', "./S01-1;2;moved;Op"]
    (root / EXCLUSIONS).write_bytes(("\ufeff" + "\n".join(rows)).replace("\n", "\r\n").encode())
    include(root, "S01-1", "1", "r", "Kim")
    lines = (root / EXCLUSIONS).read_bytes().decode().split("\r\n")
    assert lines[:2] == ["\ufeff" + rows[0], rows[1]]
    assert lines[2].startswith("# included again ")
    assert lines[3:] == ['# lines";Op', rows[3]]
    include(root, "S01-1", "2", "r", "Kim")
    assert [epoch.excluded for epoch in found_sessions(root)[0][0].epochs] == ["", ""]


def test_an_epoch_of_a_study_is_left_out_and_included_by_commands(root, rigidimeter):
    assert rigidimeter("study", "add", root, "--subject", "S01").status == 0
    who = ("--reason", "coughed", "--by", "Kim")
    for path in ("S01-1", root / "S01-1"):
        assert rigidimeter("study", "exclude", root, path, "2", *who).status == 0
        (found,), _ = found_sessions(root)
        assert [epoch.excluded for epoch in found.epochs] == ["", "coughed (Kim)"]
        assert rigidimeter("study", "include", root, path, "2", *who).status == 0
        assert [epoch.excluded for epoch in found_sessions(root)[0][0].epochs] == ["", ""]
    for path, epoch, said in (
        ("S01-2", "1", "S01-2: is not in .*sessions.csv; the nearest is S01-1"),
        ("S01-1", "7", "S01-1 has no epoch 7; its epochs are 1, 2"),
    ):
        ran = rigidimeter("study", "exclude", root, path, epoch, *who)
        assert ran.status == 1
        assert re.search(said, ran.err)


def test_a_table_that_is_none_is_not_written_over(root):
    (root / EXCLUSIONS).write_text("path,epoch\ns,1\n")
    with pytest.raises(UserError, match="there is no column reason"):
        exclude(root, "S01-1", "1", "r", "b")
    _, problems = found_sessions(root)
    assert "there is no column reason" in problems[0]


def test_an_epoch_is_drawn_from_its_samples(root):
    panes = epoch_panes(root / "S01-1", "2", root / "none.csv")
    assert [pane["title"] for pane in panes] == [
        "torque [N·m]",
        "angle [deg]",
        "perturbation [N·m]",
        "drive's torque [N·m]",
    ]
    time_s = panes[0]["data"][0]
    assert time_s[-1] - time_s[0] == pytest.approx(20.0, abs=0.02)
    assert {len(line) for pane in panes for line in pane["data"]} == {len(time_s)}
    assert [pane["spectrum"]["title"] for pane in panes] == [
        "spectrum [N·m/√Hz]",
        "spectrum [deg/√Hz]",
        *["spectrum [N·m/√Hz]"] * 2,
    ]
    rate_hz = read_manifest(root / "S01-1")["settings"]["rig"]["tick_rate_hz"]
    for pane in panes:
        assert len(pane["spectrum"]["data"]) == len(pane["data"])
        assert pane["spectrum"]["data"][0][-1] == pytest.approx(rate_hz / 2)
    with pytest.raises(UserError, match="no samples of epoch 3"):
        epoch_panes(root / "S01-1", "3", root / "none.csv")


def test_one_epoch_is_planned_again(root):
    rest = again(root / "S01-1", 2)
    assert [epoch.number for epoch in rest.epochs] == [2]
    with pytest.raises(UserError, match="no epoch 7"):
        again(root / "S01-1", 7)


def test_what_is_left_is_what_no_session_goes_on_with(tmp_path):
    """Also where epochs were repeated or continued in other folders; each is offered once."""
    planned = plan(TWICE.protocol, TWICE.prbs, TWICE.sinusoid, 1).epochs

    def session(name, epochs, done, **continues):
        writer = SessionWriter(tmp_path / name, TWICE, [asdict(e) for e in epochs], {},
                               virtual=True, continues=continues)  # fmt: skip
        for epoch in epochs[: done + 1]:
            begun = {"label": epoch.label, "task": "prbs", "condition": "OFF", "time_s": 0.0}
            writer.event("epoch_started", epoch=epoch.number, **begun)
            how = "success" if epoch in epochs[:done] else "abort"
            writer.event("epoch_ended", epoch=epoch.number, time_s=1.0, outcome=how, reason="r")
        writer.close(1.0, "abort", "r")
        return writer.session_id

    first = session("a", planned, 1)
    assert found_sessions(tmp_path)[0][0].left == (2, 3, 4)
    session("b", planned[1:2], 1, folder="a", session_id=first)
    left = {one.name: one.left for one in found_sessions(tmp_path)[0]}
    assert left == {"a": (3, 4), "b": ()}
    session("c", planned[2:], 1, folder="a", session_id=first)
    left = {one.name: one.left for one in found_sessions(tmp_path)[0]}
    assert left == {"a": (), "b": (), "c": (4,)}


def test_a_session_without_its_events_is_named_with_what_to_do(root):
    (root / "S01-1" / "events.jsonl").unlink()
    found, problems = found_sessions(root)
    assert (found, problems) == ([], ["S01-1: has no events.jsonl; put back a copy of it"])
