"""Studies with something wrong in a table or a recording: one clear sentence each, nothing lost."""

import shutil

import pytest
from tests.faults.compared_study import compared, errors, only_error
from tests.small_study import record

__all__ = ["compared"]


def test_a_sound_study_says_nothing(compared) -> None:
    ran, found = compared()
    assert (ran.status, errors(ran.err)) == (0, [])
    assert found["left_out"] == []
    assert found["notices"] == []


def test_a_rating_outside_the_scale(compared, study, edit) -> None:
    edit(study / "ratings.csv", "M1,1,OFF,A,2.0", "M1,1,OFF,A,20")
    ran, found = compared()
    only_error(ran, "ratings.csv, line 2: score is 20, outside the scale of 0 to 3")
    assert found["ratings"]["n"] == 17


def test_a_rating_that_is_no_number(compared, study, edit) -> None:
    edit(study / "ratings.csv", "M1,1,OFF,A,2.0", "M1,1,OFF,A,two")
    only_error(compared()[0], "ratings.csv, line 2", "'two'", "not a number")


def test_an_examiner_with_one_rating_is_a_notice(compared, study) -> None:
    with (study / "ratings.csv").open("a") as file:
        file.write("M1,3,OFF,D,2\n")
    ran, _ = compared()
    assert (ran.status, errors(ran.err)) == (0, [])
    assert "examiner D gave one rating" in ran.err


def test_one_condition_only(compared, study) -> None:
    path = study / "sessions.csv"
    lines = [line for line in path.read_text().splitlines() if ",DBS" not in line]
    path.write_text("\n".join(lines) + "\n")
    (study / "ratings.csv").unlink()
    ran, found = compared()
    only_error(ran, "no session in DBS, only in OFF")
    assert found["comparisons"][0]["groups"]["OFF"]["n"] == 6


def test_fewer_than_three_epochs(compared, study) -> None:
    path = study / "sessions.csv"
    lines = [line for line in path.read_text().splitlines() if line[-5:] not in ("3,DBS", "4,DBS")]
    path.write_text("\n".join(lines) + "\n")
    ran, _ = compared()
    assert (ran.status, errors(ran.err)) == (1, [])
    undecided = "whether OFF and DBS differ in impulse and work cannot be decided: a test needs 3"
    assert undecided in " ".join(ran.out.split())
    assert "there are 6 in OFF and 2 in DBS" in " ".join(ran.out.split())


def test_the_same_path_twice(compared, study) -> None:
    with (study / "sessions.csv").open("a") as file:
        file.write("./sessions/1-OFF,M1,9,OFF\n")
    ran, found = compared()
    only_error(ran, "line 8", "in the table already (line 2)")
    assert len(found["sessions"]) == 6
    assert found["left_out"][0]["day"] == "9"


def test_a_copy_under_another_name(compared, study) -> None:
    shutil.copytree(study / "sessions/1-OFF", study / "sessions/9-OFF")
    with (study / "sessions.csv").open("a") as file:
        file.write("sessions/9-OFF,M1,9,OFF\n")
    only_error(compared()[0], "line 8", "same samples as sessions/1-OFF (line 2)")


def test_a_day_twice_without_part(compared, study) -> None:
    record(study / "sessions/again", "OFF", 99, task="sinusoid")
    with (study / "sessions.csv").open("a") as file:
        file.write("sessions/again,M1,1,OFF\n")
    only_error(
        compared()[0], "line 8: subject M1, day 1, OFF, sinusoid", "already (line 2)", "column part"
    )


@pytest.mark.parametrize("table", ["sessions", "ratings"])
def test_an_unknown_condition(compared, study, edit, table) -> None:
    edit(study / f"{table}.csv", ",OFF", ",OF")
    only_error(compared()[0], f"{table}.csv, line 2: condition OF is unknown; the nearest is OFF")


def test_a_key_to_an_unknown_condition(compared, study) -> None:
    (study / "key.csv").write_text("code,condition\nA,OFF\nB,DSB\n")
    only_error(compared()[0], "key.csv, line 3: code B stands for DSB", "OFF, DBS")


def test_a_key_that_is_not_there(compared, study) -> None:
    ran, _ = compared("--key", study / "nokey.csv")
    assert ran.status == 1
    assert errors(ran.err) == [
        f"rigidimeter: {study}/nokey.csv: there is no such file, but --key names it as the table "
        "with the columns code, condition"
    ]


def test_the_table_and_the_recording_disagree(compared, study, edit) -> None:
    edit(study / "sessions.csv", "sessions/1-OFF,M1,1,OFF", "sessions/1-OFF,M1,1,DBS")
    ran, found = compared()
    only_error(ran, "the table says DBS, but", "sessions/1-OFF records OFF", "left out")
    assert len(found["sessions"]) == 5


def test_another_version_of_the_protocol(compared, study) -> None:
    shutil.rmtree(study / "sessions/3-DBS")
    swing = {"duration_s": 6.0, "motion_s": 6.0, "frequency_hz": 2.0, "taper_s": 0.5}
    record(
        study / "sessions/3-DBS",
        "DBS",
        9,
        task="sinusoid",
        sinusoid={**swing, "amplitude_deg": 7.0},
    )
    ran, found = compared()
    only_error(ran, "sessions/3-DBS", "sinusoid.amplitude_deg = 7.0", "amplitude_deg = 8.0",
               "5 of 6 sessions")  # fmt: skip
    assert [out["path"] for out in found["left_out"]] == ["sessions/3-DBS"]


def test_what_the_task_does_not_use_makes_no_other_version(compared, study) -> None:
    shutil.rmtree(study / "sessions/3-DBS")
    record(study / "sessions/3-DBS", "DBS", 9, task="sinusoid", prbs={"duration_s": 9.0})
    assert compared()[0].status == 0


def test_a_missing_path(compared, study, edit) -> None:
    edit(study / "sessions.csv", "sessions/1-OFF", "sessions/1-OF")
    only_error(compared()[0], "line 2", "sessions/1-OF: there is no such session")


@pytest.mark.parametrize("path", ["/elsewhere/1-OFF", "../1-OFF", "sessions/../../1-OFF"])
def test_a_path_outside_the_study(compared, study, edit, path) -> None:
    edit(study / "sessions.csv", "sessions/1-OFF", path)
    only_error(compared()[0], f"line 2: path is {path}, outside the study folder; copy or link")


def test_a_path_that_the_system_refuses(compared, study, edit) -> None:
    edit(study / "sessions.csv", "sessions/1-OFF", "s" * 300)
    only_error(compared()[0], "sessions.csv, line 2: sss", "too long", "left out")


def test_links_in_a_circle(compared, study, edit) -> None:
    (study / "sessions/round").symlink_to("round")
    edit(study / "sessions.csv", "sessions/1-OFF", "sessions/round")
    (study / "exclusions.csv").write_text("path,epoch,reason\nsessions/round,1,coughed\n")
    only_error(compared()[0], "line 2", "sessions/round: there is no such session")


def test_an_epoch_excluded_twice(compared, study) -> None:
    (study / "exclusions.csv").write_text(
        "path,epoch,reason,by\nsessions/1-OFF,1,coughed,NB\n./sessions/1-OFF,1,moved,XY\n"
    )
    ran, found = compared()
    assert ran.status == 0
    assert "exclusions.csv, line 3: epoch 1 of ./sessions/1-OFF is out already (line 2)" in ran.err
    assert [out["reason"] for out in found["exclusions"]] == ["coughed"]


def test_subjects_without_a_fit_hold_no_inertia(compared, study) -> None:
    for name in ("sessions.csv", "ratings.csv"):
        path = study / name
        path.write_text(path.read_text().replace("M1,3", "M2,3").replace("M1,4", "M2,4"))
    ran, _ = compared()
    assert ran.status == 0
    assert "nan" not in ran.err


def test_an_interrupted_session(compared, study, rigidimeter) -> None:
    events = study / "sessions/4-DBS/events.jsonl"
    lines = events.read_text().splitlines()
    assert "session_ended" in lines[-1]
    events.write_text("\n".join(lines[:-1]) + "\n")
    ran, _ = compared()
    only_error(ran, "was interrupted", f"rigidimeter recover {study}/sessions/4-DBS")
    assert rigidimeter("recover", study / "sessions/4-DBS").status == 0
    assert compared()[0].status == 0


def test_equal_stimulation_in_both_is_a_notice(compared, study, edit) -> None:
    edit(
        study / "study.toml",
        'title = "stimulation off"',
        "frequency_hz = 130.0\namplitude_ma = 0.32\npulse_width_us = 60.0",
    )
    ran, _ = compared()
    assert (ran.status, errors(ran.err)) == (0, [])
    assert "OFF and DBS have the same stimulation settings" in ran.err


def test_tables_as_a_spreadsheet_writes_them(compared, study) -> None:
    for name in ("sessions.csv", "ratings.csv"):
        text = (study / name).read_text().replace(".", ",") if name == "ratings.csv" else ""
        text = text or (study / name).read_text()
        rows = text.splitlines()
        if name == "ratings.csv":
            rows = [row.replace(",", ";", 4) for row in rows]
        else:
            rows = [row.replace(",", ";") for row in rows]
        (study / name).write_bytes(("\ufeff" + "\r\n".join(rows) + "\r\n").encode())
    ran, found = compared()
    assert (ran.status, errors(ran.err)) == (0, [])
    assert found["ratings"]["n"] == 18


def test_an_unknown_column_is_named_with_the_nearest(compared, study, edit) -> None:
    edit(study / "sessions.csv", "condition\n", "condition,notes\n")
    text = (study / "sessions.csv").read_text().splitlines()
    (study / "sessions.csv").write_text("\n".join([text[0], *(f"{row},x" for row in text[1:])]))
    ran, _ = compared()
    assert ran.status == 0
    assert "column notes is not read; the nearest that is known is note" in ran.err


def test_a_missing_column(compared, study, edit) -> None:
    edit(study / "sessions.csv", "subject", "subjct")
    ran, _ = compared()
    (line,) = errors(ran.err)
    assert "there is no column subject (the nearest is subjct)" in line
    assert ran.status == 1


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("sessions/1-OFF,9,coughed,NB", "sessions/1-OFF has no epoch 9; its epochs are 1, 2"),
        ("sessions/1-OF,1,coughed,NB", "is no session of sessions.csv; the nearest is"),
    ],
)
def test_an_exclusion_that_meets_no_epoch(compared, study, row, told) -> None:
    (study / "exclusions.csv").write_text(f"path,epoch,reason,by\n{row}\n")
    only_error(compared()[0], "exclusions.csv, line 2", told)


def test_an_exclusion_without_a_reason(compared, study) -> None:
    (study / "exclusions.csv").write_text("path,epoch,reason,by\nsessions/1-OFF,1,,NB\n")
    only_error(compared()[0], "exclusions.csv, line 2: no reason is given")
