"""A study folder from its tables to its conclusions, held against the parts done by hand."""

import csv
import json
import math
import re
import shutil
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_equal
from tests.replayed import assert_folder_replayed
from tests.small_study import DAYS, record, tiny

from rigidimeter.analysis.statistics import difference, fit_mixed, holm, ranksum
from rigidimeter.analysis.study import (
    RATING,
    StudyResult,
    analyse_study,
    compare,
    compare_analysis,
    conclude,
    conclusion_rows,
    difference_rows,
    estimate,
    lead,
    read_study,
    result_table,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import read_session
from rigidimeter.virtual import run_virtual_session

RESAMPLES = 200


def analysed(folder: Path, **options) -> StudyResult:
    return analyse_study(read_study(folder, **options), resamples=RESAMPLES)


@pytest.fixture(scope="module")
def whole(fitted_study: Path) -> StudyResult:
    return analysed(fitted_study)


def test_the_analysis_is_that_of_its_sessions(fitted_study: Path, whole: StudyResult) -> None:
    epochs = []
    for condition in DAYS:
        for day in DAYS[condition]:
            epochs += read_session(fitted_study / f"sessions/{day}-{condition}")[0]
    by_hand = estimate(epochs, settings=whole.settings)
    values = [fit.stiffness_nm_rad for fit in by_hand.fixed_inertia]
    assert [fit.stiffness_nm_rad for fit in whole.analysis.fixed_inertia] == values
    expected = compare_analysis(by_hand, "OFF", "DBS").comparisons
    for ours, theirs in zip(whole.comparisons[:-1], expected, strict=True):
        assert ours.test == theirs.test
    assert not [notice for notice in whole.notices if notice.level == "error"]


def test_ratings_and_effects(fitted_study: Path, whole: StudyResult) -> None:
    assert whole.ratings is not None
    with (fitted_study / "ratings.csv").open() as file:
        rows = list(csv.DictReader(file))
    fit = fit_mixed(
        [float(row["score"]) for row in rows],
        [row["condition"] for row in rows],
        {"examiner": [row["examiner"] for row in rows]},
    )
    assert whole.ratings.contrast == difference(fit, "DBS", "OFF")
    corrected = {name: [] for name in DAYS}
    for row, score in zip(rows, fit.corrected.tolist(), strict=True):
        corrected[row["condition"]].append(score)
    found = whole.comparisons
    assert found[-1].measure is RATING
    assert found[-1].test == ranksum(corrected["OFF"], corrected["DBS"])
    assert tuple(c.p_holm for c in found) == holm([c.test.p for c in found])
    inertia, *primary = found[:3]
    assert inertia.days_p_holm == inertia.days.p  # the check of the instrument, in no family
    for family in (primary, found[3:]):
        assert tuple(c.days_p_holm for c in family) == holm([c.days.p for c in family])
    assert found[-1].days.p == whole.ratings.contrast_days.p_kenward_roger
    assert len(whole.differences) == math.comb(len(found), 2)
    assert all(pair.difference.paired for pair in whole.differences)
    assert tuple(pair.p_holm for pair in whole.differences) == holm(
        [pair.difference.p for pair in whole.differences]
    )
    assert whole.virtual
    assert not whole.blinded


def test_another_measure_moves_no_other_number(study: Path) -> None:
    first = analysed(study)
    (study / "ratings.csv").unlink()
    second = analysed(study)
    assert first.comparisons[0].effects == second.comparisons[0].effects
    assert second.ratings is None


def test_a_key_gives_codes_their_conditions(study: Path) -> None:
    expected = analysed(study)
    for name in ("sessions.csv", "ratings.csv"):
        path = study / name
        lines = path.read_text().splitlines()
        coded = [line.replace(",OFF", ",Q").replace(",DBS", ",Z") for line in lines]
        path.write_text("\n".join(coded) + "\n")
    key = study.parent / "elsewhere.csv"
    key.write_text("code,condition\nQ,OFF\nZ,DBS\n")
    found = analysed(study, key=key)
    assert [c.test for c in found.comparisons] == [c.test for c in expected.comparisons]
    assert found.sessions[0].code == "Q"
    blinded = analysed(study)
    assert blinded.blinded
    assert [c.name for c in blinded.conditions] == ["Q", "Z"]
    assert {epoch.condition for epoch in blinded.epochs} == {"Q", "Z"}
    assert any("blinded" in notice.text for notice in blinded.notices)
    assert [c.test for c in blinded.comparisons] == [c.test for c in expected.comparisons]
    assert blinded.ratings is not None
    assert blinded.ratings.reference == "Q"


def test_codes_in_the_recordings_go_through_the_key(study: Path, edit) -> None:
    shutil.rmtree(study / "sessions/1-OFF")
    settings = {"Q": {"damping_nm_s_rad": 0.13}, "OFF": {}, "DBS": {}}
    record(study / "sessions/1-OFF", "Q", 5, task="sinusoid", subject=settings)
    edit(study / "sessions.csv", "M1,1,OFF", "M1,1,Q")
    (study / "key.csv").write_text("code,condition\nQ,OFF\n")
    found = analysed(study)
    assert {epoch.condition for epoch in found.epochs} == {"OFF", "DBS"}
    assert not [notice for notice in found.notices if notice.level == "error"]


def test_the_operator_takes_an_epoch_out_with_name_and_reason(study: Path) -> None:
    (study / "exclusions.csv").write_text("path,epoch,reason,by\n./sessions/2-OFF,2,coughed,NB\n")
    found = analysed(study)
    (exclusion,) = found.exclusions
    assert (exclusion.by, exclusion.reason, exclusion.who) == ("operator", "coughed", "NB")
    assert (exclusion.source, exclusion.epoch, exclusion.day) == ("sessions/2-OFF", "2", "2")
    assert found.comparisons[0].excluded == {"OFF": 1, "DBS": 0}


def test_parts_tell_two_sessions_of_one_day_apart(study: Path, edit) -> None:
    record(study / "sessions/1b", "OFF", 77, task="sinusoid")
    edit(
        study / "sessions.csv", "path,subject,day,condition\n", "path,subject,day,condition,part\n"
    )
    text = (study / "sessions.csv").read_text().splitlines()
    rows = [f"{line}," for line in text[1:]] + ["sessions/1b,M1,1,OFF,b"]
    (study / "sessions.csv").write_text("\n".join([text[0], *rows]) + "\n")
    found = analysed(study)
    assert found.comparisons[0].summaries["OFF"].n == 8
    assert found.comparisons[0].days.n_days_x == 3


def test_the_front_door_gives_the_same(study: Path, tmp_path: Path) -> None:
    found = compare(study, resamples=RESAMPLES)
    expected = analysed(study)
    assert_equal(*([asdict(one) for one in of.comparisons] for of in (found, expected)))
    assert found.differences == expected.differences
    assert not (study / "analysis").exists()
    turned = compare(study, "OFF", reference="DBS", resamples=RESAMPLES)
    assert turned.comparisons[0].test.shift == -found.comparisons[0].test.shift
    table = found.table()
    rows = conclusion_rows(found)
    assert list(table["verdict"]) == [row["verdict"] for row in rows]
    assert list(table["difference"]) == [row["difference"] for row in rows]
    assert len(table.columns) == 12
    full = found.table(full=True)
    assert list(full["days_p_holm"]) == [c.days_p_holm for c in found.comparisons]
    assert len(full.columns) > 50
    for piece in ("Small study", "DBS − OFF", difference_rows(conclude(found))[0].verdict):
        assert piece in found._repr_html_()
    work = found.comparison("work_j").summaries
    assert repr(found).startswith("Small study; OFF and DBS; medians: ")
    assert f"Work {work['OFF'].median:.4g} and {work['DBS'].median:.4g} J" in repr(found)
    assert "\n" not in repr(found)


def test_a_table_and_its_file_give_the_same(study: Path) -> None:
    path = study / "ratings.csv"
    from_file = compare(path, value="score", resamples=RESAMPLES)
    from_table = compare(pd.read_csv(path), value="score", resamples=RESAMPLES)
    assert_equal(*([asdict(one) for one in of.comparisons] for of in (from_table, from_file)))
    with pytest.raises(UserError, match="value="):
        compare(pd.read_csv(path))


def test_one_recording_of_both_conditions_has_a_row_for_each(study: Path) -> None:
    """Each row takes the epochs of its condition, as two recordings would give them."""
    settings = tiny("OFF", 55, task="sinusoid", protocol={
        "blocks": [
            {"task": "sinusoid", "condition": "OFF", "epochs": 2},
            {"task": "sinusoid", "condition": "DBS", "epochs": 1},
        ],
        "rests_s": [0.5],
        "return_s": 0.5,
    })  # fmt: skip
    run_virtual_session(settings, study / "sessions/both")
    assert_folder_replayed(study / "sessions/both")
    before = analysed(study)
    table = study / "sessions.csv"
    rows = table.read_text() + "sessions/both,M1,9,OFF\n"
    table.write_text(rows)
    alone = analysed(study)
    assert any("the table says OFF, but" in n.text for n in alone.notices)
    table.write_text(rows + "sessions/both,M1,9,DBS\n")
    found = analysed(study)
    assert found.notices == before.notices
    added = [found.comparisons[0].summaries[c].n - before.comparisons[0].summaries[c].n
             for c in ("OFF", "DBS")]  # fmt: skip
    assert added == [2, 1]
    assert [(s.day, s.condition) for s in found.sessions[-2:]] == [("9", "OFF"), ("9", "DBS")]
    table.write_text(rows + "sessions/both,M1,8,DBS\n")
    assert any("must agree on both" in n.text for n in analysed(study).notices)


def test_three_subjects_are_compared_and_words_say_so(study: Path, rigidimeter) -> None:
    """Each has a session in both conditions, so subjects are what is tested."""
    (study / "ratings.csv").unlink()
    rows = [f"sessions/{k}-OFF,S{k},1,OFF\nsessions/{k + 1}-DBS,S{k},2,DBS" for k in (1, 2, 3)]
    (study / "sessions.csv").write_text("\n".join(["path,subject,day,condition", *rows]))
    ran = rigidimeter("compare", study, "--resamples", "200", "--full")
    first, _, full = ran.out.partition("\nConditions\n")
    first, full = (" ".join(text.split()) for text in (first, full))
    assert "3 subjects · 6 days · 12 epochs, 12 used" in first
    assert "tested Paired t-test of 3 subjects; p Holm-adjusted over impulse and work; " in first
    assert re.search(r"with \d+ subjects a difference of 20 % in impulse would be shown", first)
    assert "Paired t-test of 3 subjects. In brackets: p adjusted in its family" in full
    assert "by days" not in first + full
    found = compare(study, resamples=RESAMPLES)
    assert found.resampled == "the days of each subject"
    for c in found.comparisons:
        assert c.days.unit == "subject"
        means = [[np.mean([o.value for o in c.of(name) if o.subject == f"S{k}"]) for k in (1, 2, 3)]
                 for name in c.pair]  # fmt: skip
        assert (c.days.mean_x, c.days.mean_y) == pytest.approx(np.mean(means, axis=1))
    head, *lines = (study / "sessions.csv").read_text().splitlines()
    groups = ["patients"] * 2 + ["controls"] * 4
    lines = [f"{line},{group}" for line, group in zip(lines, groups, strict=True)]
    (study / "sessions.csv").write_text("\n".join([f"{head},group", *lines]))
    assert compare(study, resamples=0).comparison("work_j").groups == ("patients", "controls")
    controls = read_study(study, group="controls").gathered.sessions
    assert {session.entry.subject for session in controls} == {"S2", "S3"}
    with pytest.raises(UserError, match=r"sessions.csv: there is no group old; there are: pat"):
        read_study(study, group="old")


def test_a_session_of_two_conditions_has_one_vote_on_the_protocol(study: Path, rigidimeter) -> None:
    """Of three sessions two are of one protocol; the third has a row for each of its conditions."""
    (study / "ratings.csv").unlink()
    blocks = [{"task": "sinusoid", "condition": name, "epochs": 2} for name in ("OFF", "DBS")]
    protocol = {"blocks": blocks, "rests_s": [0.5], "return_s": 0.5}
    sinusoid = tiny("OFF", 1).sinusoid.model_dump() | {"amplitude_deg": 6.0}
    settings = tiny("OFF", 55, task="sinusoid", protocol=protocol, sinusoid=sinusoid)
    run_virtual_session(settings, study / "sessions/both")
    assert_folder_replayed(study / "sessions/both")
    rows = ["sessions/both,M1,9,OFF", "sessions/both,M1,9,DBS"]
    rows += ["sessions/1-OFF,M1,1,OFF", "sessions/2-DBS,M1,2,DBS"]
    (study / "sessions.csv").write_text("\n".join(["path,subject,day,condition", *rows]))
    found = analysed(study)
    assert [out.path for out in found.left_out] == ["sessions/both"] * 2
    assert "but 2 of 3 sessions, such as sessions/1-OFF" in found.left_out[0].reason
    assert lead(found).endswith(" 1 of 3 sessions is left out.")
    ran = rigidimeter("compare", study, "--resamples", "200")
    shown = " ".join(ran.out.split())
    assert shown.count(f"left out sessions/both: {found.left_out[0].reason}") == 1
    assert shown.count(found.left_out[0].reason) == 1


def test_a_third_condition_is_compared_with_the_first_and_p_is_adjusted_for_all(
    study: Path, edit, rigidimeter, tmp_path
) -> None:
    """Work and impulse of three conditions: two differences with OFF each, Holm over four."""
    (study / "ratings.csv").unlink()
    edit(study / "study.toml", "[conditions.DBS]", "[conditions.LOW]\n[conditions.DBS]")
    low = {"LOW": {"damping_nm_s_rad": 0.125, "stiffness_nm_rad": 1.5}}
    for day in ("4", "5", "6"):
        record(study / f"sessions/{day}-A-LOW", "LOW", int(day), task="sinusoid", subject=low)
    rows = [f"sessions/{day}-A-LOW,M1,{day},LOW" for day in ("4", "5", "6")]
    table = study / "sessions.csv"
    head, *before = table.read_text().splitlines()
    table.write_text("\n".join([head, *rows, *before]) + "\n")
    out = tmp_path / "found.json"
    ran = rigidimeter("compare", study, "--resamples", "200", "--json", out, "--full")
    assert ran.status == 0, ran.err
    text = " ".join(ran.out.split())
    assert text.count("p Holm-adjusted over impulse and work (4 tests); each 95 % interval") == 2
    assert "DBS − OFF 95 % interval p, Holm" in text
    assert "LOW − OFF 95 % interval p, Holm" in text
    assert "LOW − OFF: days counted" in text
    document = json.loads(out.read_text())
    concluded = {(c["measure"], c["other"]): c for c in document["conclusion"]}
    assert {other for _, other in concluded} == {"DBS", "LOW"}
    p = {key: c["p"] for key, c in concluded.items()}
    np.testing.assert_allclose([c["p_holm"] for c in concluded.values()], holm([*p.values()]))
    pair = rigidimeter("compare", study, "--other", "LOW", "--resamples", "200", "--json", out)
    assert pair.status == 0
    alone = {c["measure"]: c["p"] for c in json.loads(out.read_text())["conclusion"]}
    assert alone == {measure: p[measure, "LOW"] for measure in alone}
    found = analysed(study)
    rows = [row["condition"] for row in result_table(found, "summaries")]
    assert rows == ["OFF", "LOW", "DBS"] * 2  # as in study.toml, not as the table or the folders
    shown = ran.out.partition("\nMedians and quartiles by condition\n")[2]
    assert [word for word in shown.split() if word in DAYS or word == "LOW"][:3] == rows[:3]
    again = rigidimeter("report", study, "--out", tmp_path / "page")
    assert again.status == 0, again.err
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
