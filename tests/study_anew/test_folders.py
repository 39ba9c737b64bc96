"""Study folders in both rooms, each reading and estimating them: the same is said and left out."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from benchmarks.verdicts import sessions_of
from tests.small_study import record
from tests.study_anew.both import Answers, apart, of_folder
from tests.traps.recorded_studies import write_study
from tests.unit.analysis.study import test_deviations

from rigidimeter.analysis import study_anew as new

planned_study = test_deviations.study

PAIR = ("OFF", "DBS")
Edit = Callable[[Path, str, str], None]


def same(folder: Path, **options) -> Answers | str:
    before, now = of_folder(folder, **options)
    assert not [str(one) for one in apart(before, now)]
    return now


def test_of_a_study_with_every_method_and_ratings(fitted_study: Path) -> None:
    found = same(fitted_study)
    assert len(found.conclusion) == 4
    assert len(found.tables["sensitivity"]) == 15


def test_of_a_study_of_scores(scored_study: Path) -> None:
    assert len(same(scored_study).conclusion) == 3


def test_prepared_beforehand_and_read_again(study: Path) -> None:
    loaded = new.load_study(study, pair=("DBS", "OFF"), method="iv")
    found = new.analyse(loaded, new.prepare_study(loaded))
    pd.testing.assert_frame_equal(found.rows, new.analyse(loaded).rows)
    again = found.folder_read()
    assert (again.names, again.method) == (loaded.names, "iv")
    assert [epoch.label for epoch in again.epochs] == [epoch.label for epoch in loaded.epochs]


def test_the_public_function_tells_how_far_it_is(study: Path) -> None:
    shares: list[float] = []
    found = new.compare(study, "DBS", reference="OFF", resamples=199, progress=shares.append)
    assert sum(shares) == pytest.approx(1.0)
    by_hand = new.conclude_study(new.analyse(new.load_study(study, pair=PAIR)), resamples=199)
    place = str(study)
    assert new.comparison_document(found, place) == new.comparison_document(by_hand, place)
    assert found.study.folder_read is not None


def test_other_conditions_and_a_group(study: Path) -> None:
    turned = same(study, pair=("DBS", "OFF"))
    assert turned.conclusion[0]["reference"] == "DBS"
    assert same(study, pair=("DBS", None)) == "--reference and --other are both DBS; name two " \
        "conditions"  # fmt: skip
    assert "there is no such condition" in same(study, pair=(None, "LOW"))
    assert "there is no group patients" in same(study, group="patients")


def test_codes_with_a_key_and_without(study: Path) -> None:
    for name in ("sessions.csv", "ratings.csv"):
        text = (study / name).read_text()
        (study / name).write_text(text.replace(",OFF", ",Q").replace(",DBS", ",Z"))
    assert "Blinded" in same(study).lead
    (study / "key.csv").write_text("code,condition\nQ,OFF\nZ,DBS\nQ,DBS\nX,LOW\n")
    assert same(study).conclusion[0]["reference"] == "OFF"


def test_epochs_that_the_operator_excludes(study: Path) -> None:
    rows = ["./sessions/2-OFF,2,coughed,NB", "sessions/2-OFF,2,again,", "sessions/1-OFF,9,none,",
            "sessions/2-OF,1,misspelt,", "sessions/3-DBS,1,moved,"]  # fmt: skip
    (study / "exclusions.csv").write_text("\n".join(["path,epoch,reason,by", *rows]) + "\n")
    found = same(study)
    assert [(one["by"], one["who"]) for one in found.tables["excluded_epochs"]] == [
        ("operator", "NB"),
        ("operator", ""),
    ]


def test_sessions_that_do_not_count(study: Path, edit: Edit) -> None:
    shutil.rmtree(study / "sessions/1-OFF")
    shutil.copytree(study / "sessions/2-OFF", study / "sessions/copy")
    (study / "sessions/3-OFF/events.jsonl").unlink()
    record(study / "sessions/other", "DBS", 9, task="sinusoid", scores={"cycles": 3})
    record(study / "sessions/faster", "DBS", 9, task="sinusoid", sinusoid=FASTER)
    with (study / "sessions.csv").open("a") as file:
        file.write("sessions/copy,M1,7,OFF\nsessions/2-DBS,M1,2,DBS\nsessions/4-DBS,M1,9,LOW\n")
        file.write("../away,M1,7,OFF\nsessions/other,M1,8,DBS\nsessions/faster,M1,9,DBS\n")
        file.write("sessions/2-OFF,M1,3,DBS\n")
    found = same(study)
    assert len(found.tables["left_out"]) == 8


FASTER = {
    "duration_s": 6.0,
    "motion_s": 6.0,
    "frequency_hz": 2.5,
    "taper_s": 0.5,
    "amplitude_deg": 8.0,
}


def test_nothing_is_left(study: Path) -> None:
    shutil.rmtree(study / "sessions")
    assert "no session is left to analyse" in same(study)


def test_ratings_that_are_wrong_or_odd(study: Path) -> None:
    with (study / "ratings.csv").open("a") as file:
        file.write("M1,1,OFF,A,9\nM1,1,OFF,A,\nM1,1,LOW,A,1\nM1,1,OFF,A,x\n")
        file.write("M1,9,OFF,B,1.3\nM1,1,OFF,A,2\nM1,1,OFF,D,2\n")
    assert len(same(study).notices) == 8
    (study / "ratings.csv").write_text("subject,day,condition,examiner,score\nM1,1,OFF,A,1\n")
    assert "a contrast of ratings needs both conditions" in same(study).notices[-1]


def test_one_condition_alone(study: Path) -> None:
    rows = (study / "sessions.csv").read_text().splitlines()
    (study / "sessions.csv").write_text("\n".join([r for r in rows if "DBS" not in r]) + "\n")
    assert "there is no session in DBS" in same(study).notices[0]


@pytest.mark.parametrize("subjects", [2, 3])
def test_several_subjects_in_groups(study: Path, subjects: int) -> None:
    rows = [
        f"sessions/{k}-OFF,S{k},1,OFF,{group}\nsessions/{k + 1}-DBS,S{k},2,DBS,{group}"
        for k, group in zip(range(1, subjects + 1), ("old", "young", "old"), strict=False)
    ]
    (study / "sessions.csv").write_text("\n".join(["path,subject,day,condition,group", *rows]))
    same(study)
    (study / "ratings.csv").unlink()
    same(study)
    assert len(same(study, group="old").tables["sessions"]) == 2 * (subjects - 1)


def test_declared_measures(study: Path) -> None:
    with (study / "study.toml").open("a") as file:
        file.write('[primary]\nmeasures = ["work_j", "impulse_nm_s"]\nrule = "sequence"\n')
        file.write("declared = 2026-01-01\n[analysis]\naxis = 'vertical'\n")
    assert same(study).conclusion[0]["role"] == "primary"


def test_a_study_that_was_not_carried_out_as_planned(planned_study: Path, tmp_path: Path) -> None:
    planned = Path(shutil.copytree(planned_study, tmp_path / "planned"))
    kinds = {one["kind"] for one in same(planned).tables["deviations"]}
    assert kinds == {"not done", "out of order", "short wait"}
    protocol = planned / "protocols/OFF.toml"
    protocol.write_text(protocol.read_text().replace("duration_s = 6.0", "duration_s = 7.0", 1))
    table = planned / "plan.csv"
    table.write_text(table.read_text().replace("15.0", "10.0"))
    kinds = {one["kind"] for one in same(planned).tables["deviations"]}
    assert {"plan edited", "other protocol"} <= kinds


@pytest.mark.parametrize(
    ("number", "finding"),
    [
        (1, "flagged_epochs"),
        (15, "order_of_conditions"),
        pytest.param(0, "", marks=pytest.mark.slow),
        pytest.param(5, "flagged_epochs", marks=pytest.mark.slow),
        pytest.param(13, "unused_recordings", marks=pytest.mark.slow),
    ],
)
def test_of_a_study_of_tables_with_a_trap(tmp_path: Path, number: int, finding: str) -> None:
    """A study as a laboratory has it, a CSV for each session, with what misleads in one of two."""
    folder = write_study(tmp_path / "study", sessions_of(number, lower=True), number)
    assert finding in {row["finding"] for row in same(folder).conclusion}
