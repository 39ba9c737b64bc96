"""The page of a study folder: its numbers are those of the result, and any part may be missing."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from tests.unit.analysis.report.cohorts import Design, altered, made_study, untested
from tests.unit.analysis.report.parsed_page import ParsedPage

from rigidimeter.analysis.report import SECTIONS
from rigidimeter.analysis.report import page as page_module
from rigidimeter.analysis.report.page import contents, render_page, write_report
from rigidimeter.analysis.study import Condition, StudyResult
from rigidimeter.core.words import number, p_value

SMALL = Design(days=(4, 3), epochs=(4, 4), scores=(3, 3))
NASTY = "<script>alert('x')</script>&amp;\"$_$"


def shown(result: StudyResult) -> ParsedPage:
    """Return the page without the images of its figures, which is quick."""
    return ParsedPage(render_page(result, contents(result), {}))


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


@pytest.fixture(scope="module")
def page(study: StudyResult) -> ParsedPage:
    return shown(study)


def test_ratings_are_compared_by_their_own_model(study: StudyResult, page: ParsedPage) -> None:
    found = study.ratings
    assert found is not None
    assert found.contrast_days is not None
    (row,) = (r for r in page.table("DBS − OFF: days") if r[0].startswith("Examiners"))
    assert row[1].startswith(number(found.contrast_days.estimate))  # DBS − OFF
    assert row[5].startswith(p_value(found.contrast_days.p_kenward_roger))
    contrast = page.table("Contrast of the ratings, DBS − OFF")
    assert [row[-1] for row in contrast[1:]] == [
        p_value(found.contrast.p_residual),
        p_value(found.contrast.p_satterthwaite),
        p_value(found.contrast.p_kenward_roger),
        p_value(found.contrast_days.p_kenward_roger),
    ]
    offsets = {row[1]: row[3] for row in page.table("Predicted offsets")[1:]}
    assert offsets == {name: number(b) for name, b in found.fit.offsets["examiner"].items()}


def test_the_overview_has_days_conditions_and_stimulation(page: ParsedPage) -> None:
    text = page.words("study")
    assert "Subjects1: M1" in text.replace("Subjects 1", "Subjects1")
    assert "7: 4 in OFF and 3 in DBS" in text
    row = page.table("Conditions")[2]
    assert row == ["DBS", "stimulation on", "130", "0.32", "mA", "60", "C+ 1-", "15", "3", "3"]


def test_every_excluded_epoch_is_there_and_the_account_balances(
    study: StudyResult, page: ParsedPage
) -> None:
    rows = page.table("Excluded epochs: by whom and why")[1:]
    assert len(rows) == len(study.exclusions) == 3
    assert {row[6] for row in rows} == {"protocol", "operator"}
    for row in page.table("All recorded epochs")[1:]:
        recorded, *parts = (int(cell) for cell in row[2:])
        assert recorded == sum(parts)
        assert parts[-1] == 0
    assert "neither included nor listed" not in page.words()


def test_an_epoch_that_is_not_accounted_for_is_named(study: StudyResult) -> None:
    fewer = dataclasses.replace(study, exclusions=study.exclusions[1:])
    text = shown(fewer).words("exclusions")
    assert "1 recorded epoch is neither included nor listed as excluded" in text


def test_numbers_with_the_inertia_held_are_in_the_table_of_that_name_alone(
    study: StudyResult,
) -> None:
    fits = study.analysis.fits
    held = tuple(dataclasses.replace(f, value=np.array([0.0045, 55.55, 98.76])) for f in fits)
    analysis = dataclasses.replace(study.analysis, fixed_inertia=held)
    other = dataclasses.replace(study, analysis=analysis)
    page = render_page(other, contents(other), {})
    own = ParsedPage(page).table("Damping and stiffness with the inertia fixed at its median")
    assert len(own) > 1
    assert page.count("98.76") == page.count("55.55") == len(own) - 1
    assert "with the inertia fixed." not in page


def test_sensitivity_and_changes(study: StudyResult, page: ParsedPage) -> None:
    rows = page.table("The shift by each method")[1:]
    held = page.table("The shift with J held at its median")[1:]
    assert len(rows) == sum(row.inertia == "free" for row in study.sensitivity) > 0
    assert len(rows) + len(held) == len(study.sensitivity) == 15
    assert {row[-1] for row in held} == {"no"}
    assert [row[0] for row in rows if row[-1] == "yes"] == [
        "Inertia J (kg·m²)",
        "Viscous damping B (N·m·s/rad)",
        "Stiffness K (N·m/rad)",
    ]
    assert "changes" not in page.sections
    changed = made_study(SMALL, changes=("sessions/M1-day-09: new",))
    assert "sessions/M1-day-09: new" in shown(changed).words("changes")


def test_a_study_without_ratings_sensitivity_or_exclusions() -> None:
    bare = made_study(SMALL, ratings=None, sensitivity=(), exclusions=(), differences=())
    page = shown(bare)
    assert "nan" not in page.words().split()
    assert not {"ratings", "sensitivity", "excluded_epochs"} & set(page.sections)
    assert not any(name.startswith("Differences") for name in page.rows)


def test_a_measure_that_days_cannot_test_says_why(study: StudyResult) -> None:
    page = shown(untested(study, "work_j", "there is one day in each condition"))
    (row,) = (r for r in page.table("DBS − OFF: days") if r[0].startswith("Work"))
    assert row[-1] == "there is one day in each condition"
    assert (
        "Whether OFF and DBS differ in work cannot be decided: there is one day in each condition."
    ) in page.words()


def test_a_blinded_study_keeps_its_codes_and_shows_no_stimulation() -> None:
    blind = made_study(dataclasses.replace(SMALL, names=("a7", "k2")), blinded=True)
    page = shown(blind)
    text = page.words()
    assert text.count("are codes") >= 3
    assert "k2 against a7" in " ".join(page.rows)
    assert not re.search(r"130 Hz|stimulation|0\.32 mA|\bOFF\b|\bDBS\b", text)


def test_the_test_by_days_is_said_in_words(page: ParsedPage) -> None:
    assert "Welch's t-test of 4 days of OFF and 3 days of DBS" in page.words("comparison")
    assert "Satterthwaite FE" in page.words("methods")
    study = made_study(dataclasses.replace(SMALL, both_on_a_day=True))
    page = shown(study)
    assert "Paired t-test of 4 days. In brackets" in page.words("comparison")
    assert "by the means of the days: paired t-test of 4 days" in page.words("methods")
    words = "t-test paired by 4 days, with 5 days of OFF alone at weight 0.28"
    page = shown(
        altered(
            study,
            lambda c: dataclasses.replace(c, days=dataclasses.replace(c.days, test=words)),
        )
    )
    assert "T-test paired by 4 days, with 5 days of OFF alone" in page.words("comparison")
    assert f"{words}, with 95 % intervals. The weights follow from the" in page.words("methods")


def test_several_subjects_are_distinguished() -> None:
    design = Design((3, 3), (3, 3), (2, 2), subjects=("M1", "M2"), both_on_a_day=True)
    page = shown(made_study(design))
    assert "2: M1, M2" in page.words("study")
    assert "6: 6 in OFF and 6 in DBS, 6 in both" in page.words("study")
    assert "In these two subjects, " in page.words()
    assert "J held at the median of the same subject" in page.words()


def test_one_condition_alone_has_a_page() -> None:
    study = dataclasses.replace(
        made_study(SMALL), comparisons=(), differences=(), ratings=None, sensitivity=()
    )
    page = shown(study)
    assert "No two conditions were compared." in page.words("comparison")
    assert "effects" not in page.sections


def test_special_characters_are_escaped(tmp_path: Path) -> None:
    design = dataclasses.replace(
        SMALL, names=(NASTY, "DBS"), subjects=(NASTY,), examiners=(NASTY, "B")
    )
    study = made_study(design, changes=(NASTY,))
    conditions = (Condition(NASTY, NASTY, electrodes=NASTY), Condition("DBS"))
    study = dataclasses.replace(study, title=NASTY, conditions=conditions)
    page = shown(study)
    assert len(page.scripts) == 2  # its own: the traces, and what opens them
    assert not any("<script>" in script for script in page.scripts)
    assert page.text.count(NASTY) > 20


OWN = ("effects", "ratings", "sensitivity")
LONG = ("days", "distributions", "perturbation", "torque", "voluntary", "loops", "recorded")
"""Sections whose figures take long and have their own tests."""


def short_report(study: StudyResult, folder: Path) -> Path:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(page_module, "SECTIONS", [s for s in SECTIONS if s.name not in LONG])
        return write_report(study, folder)


@pytest.fixture(scope="module")
def written(study: StudyResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return short_report(study, tmp_path_factory.mktemp("report") / "a")


def test_the_same_study_gives_the_same_bytes(
    study: StudyResult, written: Path, tmp_path: Path
) -> None:
    again = short_report(study, tmp_path / "b")
    files = [path for path in written.parent.rglob("*") if path.is_file()]
    names = {path.relative_to(written.parent).as_posix() for path in files}
    assert {"methods.txt", "tables/comparisons.csv", "tables/account.csv"} <= names
    assert {f"figures/{name}.svg" for name in OWN} <= names
    for path in files:
        assert (again.parent / path.relative_to(written.parent)).read_bytes() == path.read_bytes()
    text = written.read_text(encoding="utf-8")
    assert text.count("<figcaption>") == sum(name.endswith("svg") for name in names)
    assert not re.search(r"url\([^#]|@import|https?:", text)


def test_virtual_data_say_so_in_every_figure(
    study: StudyResult, written: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_module, "SECTIONS", [s for s in SECTIONS if s.name in OWN])
    virtual = write_report(dataclasses.replace(study, virtual=True), tmp_path)
    assert len(list((tmp_path / "figures").glob("*.svg"))) == 3
    for name in OWN:
        one, other = (
            (page.parent / "figures" / f"{name}.svg").read_text() for page in (written, virtual)
        )
        assert ">virtual data</text>" not in one
        assert ">virtual data</text>" in other
