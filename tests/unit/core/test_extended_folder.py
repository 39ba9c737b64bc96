"""A folder of sessions becomes a study, and keeps what people wrote."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import SessionWriter
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import (
    extend_study,
    is_own,
    read_study_folder,
    recorded_session,
    session_rows,
)

NOON = datetime(2026, 3, 1, 12).astimezone(UTC).isoformat()
"""By the clock on this computer's wall: a session is of the day that it had there."""

STIMULATION = {"frequency_hz": 130.0, "amplitude_ma": 2.5}


def record(folder: Path, *conditions: str, subject="S01", closed=True, virtual=True, **about):
    """Write a session of one epoch a condition, rated 1.5 and then, in its first epoch, 2."""
    writer = SessionWriter(folder, Settings(), [], {}, virtual=virtual,
                           about={"subject": subject, **about},
                           created_utc=NOON)  # fmt: skip
    for number, condition in enumerate(conditions, start=1):
        begun = {"epoch": number, "label": str(number), "task": "prbs", "condition": condition}
        writer.event("epoch_started", time_s=1.0 * number, **begun)
        writer.event("epoch_ended", epoch=number, time_s=number + 0.5, outcome="success", reason="")
        writer.event("note", what="rating", epoch=number, score=1.5, by="E1")
    if conditions:
        writer.event("note", what="rating", epoch=1, score=2.0, by="E1")
    if closed:
        writer.close(9.0, "success", "")
    else:
        writer.close_files()
    return folder


def cells(study: Path, name: str):
    return [list(row.cells.values()) for row in getattr(read_study_folder(study), name)]


def test_sessions_become_a_study(tmp_path):
    record(tmp_path / "a", "OFF", "DBS", stimulation=STIMULATION)
    record(tmp_path / "b", "DBS", note="resumed")
    said = extend_study(tmp_path)
    assert said == [
        "a: added to sessions.csv, subject S01, day 2026-03-01.",
        "b: added to sessions.csv, subject S01, day 2026-03-01.",
    ]
    assert cells(tmp_path, "sessions") == [
        ["a", "S01", "2026-03-01", "OFF", "", "", ""],
        ["a", "S01", "2026-03-01", "DBS", "", "", ""],
        ["b", "S01", "2026-03-01", "DBS", "2", "", "resumed"],
    ]
    assert cells(tmp_path, "ratings") == [
        ["S01", "2026-03-01", "OFF", "E1", "2", "a, epoch 1"],
        ["S01", "2026-03-01", "DBS", "E1", "1.5", "a, epoch 2"],
        ["S01", "2026-03-01", "DBS", "E1", "2", "b, epoch 1"],
    ]
    about = read_study_folder(tmp_path).about
    assert (about.reference, about.other) == ("OFF", "DBS")
    assert about.conditions["DBS"].frequency_hz == 130.0
    assert about.conditions["OFF"].frequency_hz is None
    assert "primary" in about.model_fields_set
    assert about.primary.declared is None
    before = {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    assert extend_study(tmp_path) == []
    assert before == {path: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}


def test_what_a_person_wrote_stays(tmp_path):
    """Another separator, comments, a deleted column, a title: all as it was, byte for byte."""
    record(tmp_path / "a", "OFF")
    extend_study(tmp_path)
    toml = (tmp_path / "study.toml").read_text().replace(f'"{tmp_path.name}"', '"Elbow"')
    (tmp_path / "study.toml").write_text(toml)
    table = "path;subject;day;condition;part\r\n# mine\r\na;S1;day 1;OFF;\r\n# c;S1;day 1;OFF;\r\n"
    (tmp_path / "sessions.csv").write_bytes(table.encode())
    record(tmp_path / "b", "DBS", stimulation=STIMULATION)
    record(tmp_path / "c", "DBS")
    said = extend_study(tmp_path)
    assert said[0] == "b: added to sessions.csv, subject S01, day 2026-03-01."
    assert "frequency_hz = 130.0, amplitude_ma = 2.5; study.toml says otherwise" in said[1]
    assert len(said) == 2
    after = (tmp_path / "sessions.csv").read_bytes().decode()
    assert after == table + "b;S01;2026-03-01;DBS;\r\n"
    assert (tmp_path / "study.toml").read_text() == toml


def test_stimulation_and_conditions_come_as_they_are_recorded(tmp_path):
    record(tmp_path / "a", "OFF")
    extend_study(tmp_path)
    assert is_own((tmp_path / "study.toml").read_bytes())
    record(tmp_path / "b", "DBS", stimulation=STIMULATION)
    extend_study(tmp_path)
    assert read_study_folder(tmp_path).about.conditions["DBS"].amplitude_ma == 2.5
    record(tmp_path / "c", "DBS", stimulation=STIMULATION | {"frequency_hz": 60.0})
    assert "60.0" in extend_study(tmp_path)[1]
    assert read_study_folder(tmp_path).about.conditions["DBS"].frequency_hz == 130.0


def test_codes_stay_codes(tmp_path):
    """Then the study is analysed blinded, for none of its conditions has the name of one."""
    record(tmp_path / "a", "X1", "X2", stimulation=STIMULATION)
    extend_study(tmp_path, known=["OFF", "DBS"])
    about = read_study_folder(tmp_path).about
    assert (about.reference, about.other, sorted(about.conditions)) == (
        "OFF",
        "DBS",
        ["DBS", "OFF"],
    )
    assert about.conditions["DBS"].frequency_hz is None


def test_a_third_condition_is_written_or_the_session_is_refused(rigidimeter, tmp_path):
    """What `compare` would throw out is not reported as added."""
    for name in ("OFF", "DBS", "low DBS"):
        record(tmp_path / name, name)
        assert rigidimeter("study", "add", tmp_path).status == 0
    about = read_study_folder(tmp_path).about
    assert [*about.conditions] == ["OFF", "DBS", "low DBS"]
    assert (about.reference, about.other) == ("OFF", "DBS")
    toml, table = tmp_path / "study.toml", tmp_path / "sessions.csv"
    toml.write_text(toml.read_text() + "# mine\n")
    before = table.read_text()
    record(tmp_path / "d", "cold arm")
    ran = rigidimeter("study", "add", tmp_path, tmp_path / "d")
    assert ran.status == 1
    assert 'write [conditions."cold arm"] there and add the session again' in ran.err
    assert table.read_text() == before
    toml.write_text(toml.read_text() + '[conditions."cold arm"]\n')
    assert rigidimeter("study", "add", tmp_path).status == 0
    assert cells(tmp_path, "sessions")[-1][:4] == ["d", "S01", "2026-03-01", "cold arm"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"closed": False}, "was not closed"),
        ({"subject": ""}, "does not say its subject"),
        ({"virtual": False}, "on a real rig, the sessions of the study on a virtual one"),
    ],
)
def test_what_does_not_belong_is_not_added(tmp_path, changes, said):
    extend_study(tmp_path, [record(tmp_path / "a", "OFF")])
    record(tmp_path / "b", "DBS", **changes)
    (line,) = extend_study(tmp_path, [tmp_path / "b"])
    assert said in line
    assert len(cells(tmp_path, "sessions")) == 1


def test_a_session_without_a_subject_is_named_and_fails(tmp_path, rigidimeter):
    record(tmp_path / "a", "OFF", subject="")
    ran = rigidimeter("study", "add", tmp_path)
    assert ran.status == 1
    assert "a: does not say its subject; name it with --subject" in ran.err
    assert rigidimeter("study", "add", tmp_path, "--subject", "S01").status == 0


def test_a_session_elsewhere_and_one_without_epochs(tmp_path):
    study = tmp_path / "study"
    (outside,) = extend_study(study, [record(tmp_path / "a", "OFF")])
    assert "lies outside the study folder" in outside
    (empty,) = extend_study(study, [record(study / "b")])
    assert "no epoch was begun" in empty
    assert not (study / "study.toml").exists()


def test_an_interrupted_addition_is_done_again_without_doubles(tmp_path, monkeypatch):
    record(tmp_path / "a", "OFF")
    module = "rigidimeter.core.study_files.extended_folder.session_rows"
    with monkeypatch.context() as patched:
        patched.setattr(module, lambda *_: (_ for _ in ()).throw(UserError("power cut")))
        with pytest.raises(UserError, match="power cut"):
            extend_study(tmp_path)
    extend_study(tmp_path)
    assert len(cells(tmp_path, "sessions")) == 1
    assert len(cells(tmp_path, "ratings")) == 1


def test_the_day_is_that_of_the_laboratory():
    manifest = {"created_utc": "2026-03-01T23:30:00+02:00", "virtual": True}
    assert recorded_session("a", manifest, [], UTC).day == "2026-03-01"
    manifest = {"created_utc": "2026-03-01T23:30:00-02:00", "virtual": True}
    assert recorded_session("a", manifest, [], UTC).day == "2026-03-02"


def test_a_part_is_a_number_that_is_free(tmp_path):
    row = {"subject": "S", "day": "1", "condition": "OFF"}
    manifest = {"created_utc": "2026-03-01T12:00:00+00:00", "virtual": True}
    begun = {"event": "epoch_started", "epoch": 1, "label": "1", "condition": "OFF"}
    session = recorded_session("a", manifest | {"about": {"subject": "S"}}, [begun], UTC)
    before = [row | {"day": session.day, "part": part} for part in ("", "3")]
    assert session_rows(session, before)[0]["part"] == "4"


def test_the_command_adds_sessions_and_a_table_without_a_column_is_refused(rigidimeter, tmp_path):
    record(tmp_path / "sessions/a", "OFF", subject="")
    assert "name it with --subject" in rigidimeter("study", "add", tmp_path).err
    ran = rigidimeter("study", "add", tmp_path, "--subject", "S02")
    assert "sessions/a: added to sessions.csv, subject S02, day 2026-03-01" in ran.out
    table = tmp_path / "sessions.csv"
    table.write_text("path,subject,day,condition\nsessions/a,S02,2026-03-01,OFF\n")
    record(tmp_path / "sessions/b", "OFF", subject="S02")
    ran = rigidimeter("study", "add", tmp_path)
    assert "there is no column part for '2'; add it" in ran.err
