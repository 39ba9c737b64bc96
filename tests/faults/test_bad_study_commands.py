"""Studies whose description, method, options or output are wrong; and those that are sound."""

import json
import shutil
from datetime import date
from pathlib import Path

import pytest
from tests.faults.compared_study import compared, errors, only_error

from rigidimeter.core.study_files import PrimaryTable, read_study_toml

__all__ = ["compared"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("title =", "titel =", "titel is not a setting; the nearest is title"),
        ("frequency_hz = 130.0", "frequency_hz = -1.0", "than or equal to 0, in Hz"),
        ("frequency_hz = 130.0", "frequency_hz = nan", "a finite number, in Hz"),
        (
            "[conditions.OFF]",
            "[rating]\nscale = [0, nan]\n[conditions.OFF]",
            "rating.scale[1] = nan: Input should be a finite number",
        ),
        ("[conditions.OFF]", "[conditions]\nON = 5\n[conditions.OFF]", "be a table, as in [cond"),
        ('title = "Small study"', 'title = "T"\nratings = "/r.csv"', "outside the study folder"),
        ('title = "Small study"', 'title = "T"\nsessions = "../s.csv"', "name a file in it"),
        ("amplitude_ma = 0.32", "amplitude_ma = 0.3\namplitude_v = 2.0", "are both given"),
        ("[conditions.OFF]", "[primary]\nmeasures = []\n[conditions.OFF]", "at least 1 item"),
        (
            "[conditions.OFF]",
            '[primary]\nmeasures = ["inertia_kg_m2"]\n[conditions.OFF]',
            "primary.measures[0] = 'inertia_kg_m2': Input should be 'stiffness_nm_rad', 'damping",
        ),
        (
            "[conditions.OFF]",
            '[primary]\nmeasures = ["work_j", "work_j"]\n[conditions.OFF]',
            "measures names work_j twice; name each measure once",
        ),
        (
            "[conditions.OFF]",
            "[primary]\ndifference_percent = 0.2\n[conditions.OFF]",
            "primary.difference_percent = 0.2: Input should be greater than or equal to 1, in %",
        ),
        (
            "[conditions.OFF]",
            '[primary]\ndeclared = "November"\n[conditions.OFF]',
            "primary.declared = 'November': Input should be a valid date",
        ),
        ('other = "DBS"', 'other = "OFF"', "reference and other are both 'OFF'"),
        ('other = "DBS"', 'other = "DSB"', "there is no [conditions.DSB]"),
        ("study/1", "study/9", "this version reads 'rigidimeter.study/1'"),
        ('schema = "rigidimeter.study/1"\n', "", "schema is missing"),
        ('title = "Small study"', 'title = "', "is not valid TOML"),
        ('title = "Small study"', 'title = "T"\nratings = "r.csv"', "r.csv: there is no such file"),
    ],
)
def test_a_description_that_is_wrong(compared, study, edit, old, new, told) -> None:
    edit(study / "study.toml", old, new)
    ran, found = compared()
    (line,) = errors(ran.err)
    assert told in line
    assert ran.status == 1
    assert found is None


@pytest.mark.parametrize(
    ("method", "told"),
    [
        ("ivv", "ivv: there is no such method; the nearest is iv"),
        ("ml", "ml: there is no such method; the nearest is"),
    ],
)
def test_an_unknown_method(compared, study, method, told) -> None:
    with (study / "study.toml").open("a") as file:
        file.write(f'[analysis]\nmethod = "{method}"\n')
    (line,) = errors(compared()[0].err)
    assert told in line


def test_no_session_is_left(compared, study) -> None:
    shutil.rmtree(study / "sessions")
    ran, _ = compared()
    assert ran.status == 1
    assert "no session is left to analyse" in errors(ran.err)[0]


def test_a_study_beside_other_inputs(rigidimeter, study) -> None:
    ran = rigidimeter("compare", study, study / "sessions/1-OFF")
    assert ran.status == 1
    assert "is a study folder and names its own recordings" in ran.err


def test_an_option_of_recordings(compared) -> None:
    ran, _ = compared("--condition", "OFF")
    assert ran.status == 1
    assert "--condition: is for single recordings" in ran.err


def test_a_key_without_a_study(rigidimeter, study) -> None:
    ran = rigidimeter("compare", study / "sessions/1-OFF", "--key", study / "key.csv")
    assert ran.status == 1
    assert "is for a study folder" in ran.err


def test_a_folder_that_cannot_be_written_loses_no_result(compared, study) -> None:
    (study / "analysis").write_text("a file in its place")
    ran, _ = compared()
    only_error(ran, "the analysis is not stored", "analysis: cannot be written")
    assert "comparison.json and tables" not in ran.out


@pytest.mark.parametrize("name", ["study.toml", "ratings.csv", "analysis/comparison.json"])
def test_the_studys_own_files_are_never_written_over(compared, study, name) -> None:
    compared()
    before = (study / name).read_bytes()
    ran, _ = compared("--json", study / name)
    assert ran.status == 1
    assert f"{name}: is read or written already" in ran.err
    assert (study / name).read_bytes() == before


def test_one_offset_a_day_decides_nothing_and_that_is_said(compared, study) -> None:
    ran, before = compared()
    assert "one_offset_a_day" not in ran.err
    with (study / "study.toml").open("a") as file:
        file.write("\n[analysis]\none_offset_a_day = true\n")
    ran, after = compared()
    assert "study.toml: one_offset_a_day has no effect any more" in ran.err
    assert [row["days"] for row in after["comparisons"]] == [
        row["days"] for row in before["comparisons"]
    ]


def test_a_study_that_declared_nothing_keeps_the_family_of_an_earlier_comparison(
    compared, study
) -> None:
    _, found = compared()
    assert found["primary"]["source"] == "default"
    assert found["primary"]["measures"] == ["stiffness_nm_rad", "damping_nm_s_rad"]
    kept = study / "analysis/comparison.json"
    assert compared()[1]["primary"] == found["primary"]
    kept.write_text(json.dumps({name: x for name, x in found.items() if name != "primary"}))
    for _ in range(2):  # also the next comparison
        ran, again = compared()
        assert "all measures stay one family by Holm's method, J among them" in ran.err
        assert again["primary"]["source"] == "earlier comparison"
        assert {row["role"] for row in again["conclusion"]} == {"primary"}
        assert {row["adjusted_for"] for row in again["conclusion"]} == {len(again["conclusion"])}
    with (study / "study.toml").open("a") as file:
        file.write('\n[primary]\nmeasures = ["work_j", "impulse_nm_s"]\nrule = "sequence"\n')
    ran, declared = compared()
    assert "family" not in ran.err
    assert declared["primary"]["source"] == "study.toml"
    rows = {row["measure"]: row for row in declared["conclusion"]}
    assert rows["work_j"]["p_holm"] == rows["work_j"]["p"]
    assert rows["impulse_nm_s"]["p_holm"] == max(rows[n]["p"] for n in ("work_j", "impulse_nm_s"))
    assert rows["rating"]["role"] == "secondary"


@pytest.mark.parametrize(("day", "late"), [("2026-03-01", False), ("2026-03-02", True)])
def test_a_declaration_after_the_first_recording_is_said(compared, study, edit, day, late) -> None:
    edit(study / "sessions.csv", "M1,1,", "M1,2026-03-01,")
    with (study / "study.toml").open("a") as file:
        file.write(f"\n[primary]\ndeclared = {day}\n")
    ran, found = compared()
    assert ("declared on 2026-03-02, after the first recording, of 2026-03-01" in ran.err) is late
    assert found["primary"]["declared"] == day
    assert found["primary"]["declared_after_first_recording"] is late


def test_the_comparison_as_json_is_the_kept_one(compared, study, tmp_path) -> None:
    _, found = compared("--json", tmp_path / "out.json")
    assert json.loads((tmp_path / "out.json").read_text()) == found


def test_a_report_of_a_study(rigidimeter, study, tmp_path, no_figures) -> None:
    ran = rigidimeter("report", study, "--out", tmp_path / "page")
    assert ran.status == 0
    assert (tmp_path / "page/report.html").is_file()
    assert "Small study" in (tmp_path / "page/report.html").read_text()
    ran = rigidimeter("report", study, "--out", study)
    assert ran.status == 1
    assert "name another folder" in ran.err


def test_a_new_study_is_complete_and_never_written_over(rigidimeter, tmp_path: Path) -> None:
    folder = tmp_path / "fresh"
    assert rigidimeter("study", "new", folder, "--title", 'A "title"').status == 0
    assert sorted(path.name for path in folder.iterdir()) == [
        "data-dictionary.csv", "exclusions.csv", "ratings.csv", "sessions.csv", "study.toml",
    ]  # fmt: skip
    assert read_study_toml(folder / "study.toml").primary == PrimaryTable(declared=date.today())
    before = (folder / "study.toml").read_bytes()
    ran = rigidimeter("study", "new", folder)
    assert ran.status == 1
    assert "is there already" in ran.err
    assert (folder / "study.toml").read_bytes() == before
    ran = rigidimeter("compare", folder)
    assert ran.status == 1
    assert "sessions.csv: holds no session" in ran.err
