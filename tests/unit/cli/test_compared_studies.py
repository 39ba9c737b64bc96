"""What `compare` and `report` show of study folders and tables beyond one subject and one pair."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.small_study import DAYS, record
from tests.unit.analysis.study.test_folders import one_vote, subjects
from tests.unit.analysis.study.test_sentences import grouped

from rigidimeter.analysis.statistics import holm
from rigidimeter.analysis.study import compare, result_table


def plain(text: str) -> str:
    return " ".join(text.split())


def test_three_subjects_are_compared_and_words_say_so(study: Path, rigidimeter) -> None:
    """Each has a session in both conditions, so subjects are what is tested."""
    subjects(3)(study)
    ran = rigidimeter("compare", study, "--resamples", "200", "--full")
    first, _, full = ran.out.partition("\nConditions\n")
    first, full = plain(first), plain(full)
    assert "3 subjects · 6 days · 12 epochs, 12 used" in first
    assert "tested Paired t-test of 3 subjects; p Holm-adjusted over impulse and work; " in first
    assert re.search(r"with \d+ subjects a difference of 20 % in impulse would be shown", first)
    assert "Paired t-test of 3 subjects. In brackets: p adjusted in its family" in full
    assert "by days" not in first + full


def test_a_session_that_is_left_out_is_named_once(study: Path, rigidimeter) -> None:
    one_vote(study)
    reason = compare(study, resamples=0).study.left_out[0].reason
    shown = plain(rigidimeter("compare", study, "--resamples", "200").out)
    assert shown.count(f"left out sessions/both: {reason}") == 1
    assert shown.count(reason) == 1


def test_a_third_condition_is_compared_with_the_first_and_p_is_adjusted_for_all(
    study: Path, edit: Callable, rigidimeter, tmp_path: Path
) -> None:
    """Work and impulse of three conditions: two differences with OFF each, Holm over four."""
    (study / "ratings.csv").unlink()
    edit(study / "study.toml", "[conditions.DBS]", "[conditions.LOW]\n[conditions.DBS]")
    low = {"LOW": {"damping_nm_s_rad": 0.125, "stiffness_nm_rad": 1.5}}
    for day in ("4", "5", "6"):
        record(study / f"sessions/{day}-A-LOW", "LOW", int(day), task="sinusoid", subject=low)
    rows = [f"sessions/{day}-A-LOW,M1,{day},LOW" for day in ("4", "5", "6")]
    head, *before = (study / "sessions.csv").read_text().splitlines()
    (study / "sessions.csv").write_text("\n".join([head, *rows, *before]) + "\n")
    out = tmp_path / "found.json"
    ran = rigidimeter("compare", study, "--resamples", "200", "--json", out, "--full")
    text = plain(ran.out)
    assert text.count("p Holm-adjusted over impulse and work (4 tests); each 95 % interval") == 2
    for words in ("DBS − OFF 95 % interval p, Holm", "LOW − OFF 95 % interval p, Holm",
                  "LOW − OFF: days counted"):  # fmt: skip
        assert words in text
    concluded = json.loads(out.read_text())["conclusion"]
    assert {one["other"] for one in concluded} == {"DBS", "LOW"}
    p = {(one["measure"], one["other"]): one["p"] for one in concluded}
    np.testing.assert_allclose([one["p_holm"] for one in concluded], holm([*p.values()]))
    rigidimeter("compare", study, "--other", "LOW", "--resamples", "200", "--json", out)
    alone = {one["measure"]: one["p"] for one in json.loads(out.read_text())["conclusion"]}
    assert alone == {measure: p[measure, "LOW"] for measure in alone}
    found = compare(study, resamples=0)
    names = [row["condition"] for row in result_table(found, "summaries")]
    assert names == ["OFF", "LOW", "DBS"] * 2  # as in study.toml, not as the table or the folders
    shown = ran.out.partition("\nMedians and quartiles by condition\n")[2]
    assert [word for word in shown.split() if word in (*DAYS, "LOW")][:3] == names[:3]


@pytest.mark.usefixtures("no_figures")
def test_a_page_has_each_condition_beside_the_reference(study: Path, edit, rigidimeter, tmp_path):
    edit(study / "study.toml", "[conditions.DBS]", "[conditions.LOW]\n[conditions.DBS]")
    low = {"LOW": {"damping_nm_s_rad": 0.125, "stiffness_nm_rad": 1.5}}
    record(study / "sessions/4-LOW", "LOW", 4, task="sinusoid", subject=low)
    with (study / "sessions.csv").open("a") as file:
        file.write("sessions/4-LOW,M1,4,LOW\n")
    rigidimeter("report", study, "--out", tmp_path / "page")
    page = (tmp_path / "page/report.html").read_text()
    assert "LOW against OFF" in page
    assert "DBS against OFF" in page


def test_ratings_without_a_session_are_one_message_and_a_group_is_not_stored(
    study: Path, rigidimeter
) -> None:
    with (study / "ratings.csv").open("a") as file:
        file.writelines(f"M1,{day},OFF,A,2.0\n" for day in (8, 9))
    ran = rigidimeter("compare", study, "--resamples", "100")
    (line,) = [one for one in ran.err.splitlines() if "there is no session of subject" in one]
    assert "M1 on day 8 and others; these 2 ratings are used all the same" in line
    before = (study / "analysis" / "comparison.json").read_bytes()
    table = study / "sessions.csv"
    head, *rows = table.read_text().splitlines()
    table.write_text("\n".join([f"{head},group", *(f"{row},patients" for row in rows)]) + "\n")
    ran = rigidimeter("compare", study, "--resamples", "100", "--group", "patients")
    assert "group patients" in ran.out
    assert (study / "analysis" / "comparison.json").read_bytes() == before


def test_the_command_line_takes_a_group(tmp_path: Path, rigidimeter) -> None:
    path = tmp_path / "k.csv"
    pd.DataFrame(grouped(-0.18, 0.0)).to_csv(path, index=False)
    command = ("compare", path, "--value", "k", "--resamples", "100")
    said = plain(rigidimeter(*command).out)
    assert "a difference in k is not supported: each group alone: patients −18.0 %" in said
    ran = rigidimeter(*command, "--group", "patients")
    assert ran.out.startswith("OFF and ON · group patients\n")
    assert "k is lower in ON than in OFF" in plain(ran.out)
    ran = rigidimeter("report", path, "--group", "patients", "--out", tmp_path / "report")
    assert ran.status
    assert "--group patients: recordings name no group; give a study folder" in ran.err
