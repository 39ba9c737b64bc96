"""The page of a study folder: its numbers are those of the result, and any part may be missing."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from tests.unit.analysis.report.cohorts import (
    Design,
    altered,
    bare,
    made_study,
    of_result,
    of_study,
)
from tests.unit.analysis.report.parsed_page import ParsedPage, sections_without

from rigidimeter.analysis.report import SECTIONS, Shown, page_text, report
from rigidimeter.analysis.statistics import DayDifference, difference
from rigidimeter.analysis.study import Compared, Condition
from rigidimeter.core.words import number, p_value

SMALL = Design(days=(4, 3), epochs=(4, 4), scores=(3, 3))
NASTY = "<script>alert('x')</script>&amp;\"$_$"


def page_of(study: Shown) -> ParsedPage:
    """Return the page without the images of its figures, which is quick."""
    return ParsedPage(page_text(study))


@pytest.fixture(scope="module")
def study() -> Shown:
    return made_study(SMALL)


@pytest.fixture(scope="module")
def page(study: Shown) -> ParsedPage:
    return page_of(study)


def test_ratings_are_compared_by_their_own_model(study: Shown, page: ParsedPage) -> None:
    found = study.study.ratings
    assert found is not None
    assert found.by_day is not None
    alone, by_day = (difference(fit, "DBS", "OFF") for fit in (found.fit, found.by_day))
    (row,) = (r for r in page.table("DBS − OFF: days") if r[0].startswith("Examiners"))
    assert row[1].startswith(number(by_day.estimate))  # DBS − OFF
    assert row[5].startswith(p_value(by_day.p_kenward_roger))
    contrast = page.table("Contrast of the ratings, DBS − OFF")
    assert [row[-1] for row in contrast[1:]] == [
        p_value(alone.p_residual),
        p_value(alone.p_satterthwaite),
        p_value(alone.p_kenward_roger),
        p_value(by_day.p_kenward_roger),
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
    study: Shown, page: ParsedPage
) -> None:
    rows = page.table("Excluded epochs: by whom and why")[1:]
    assert len(rows) == len(study.study.exclusions) == 3
    assert {row[6] for row in rows} == {"protocol", "operator"}
    for row in page.table("All recorded epochs")[1:]:
        recorded, *parts = (int(cell) for cell in row[2:])
        assert recorded == sum(parts)
        assert parts[-1] == 0
    assert "neither included nor listed" not in page.words()


def test_an_epoch_that_is_not_accounted_for_is_named(study: Shown) -> None:
    fewer = of_study(study, exclusions=study.study.exclusions[1:])
    text = page_of(fewer).words("exclusions")
    assert "1 recorded epoch is neither included nor listed as excluded" in text


def test_numbers_with_the_inertia_held_are_in_the_table_of_that_name_alone(
    study: Shown,
) -> None:
    fits = study.analysis.fits
    held = tuple(dataclasses.replace(f, value=np.array([0.0045, 55.55, 98.76])) for f in fits)
    analysis = dataclasses.replace(study.analysis, fixed_inertia=held)
    other = of_study(study, analysis=analysis)
    page = page_text(other)
    own = ParsedPage(page).table("Damping and stiffness with the inertia fixed at its median")
    assert len(own) > 1
    assert page.count("98.76") == page.count("55.55") == len(own) - 1
    assert "with the inertia fixed." not in page


def test_sensitivity_and_changes(study: Shown, page: ParsedPage) -> None:
    rows = page.table("The shift by each method")[1:]
    held = page.table("The shift with J held at its median")[1:]
    assert len(rows) == sum(one.inertia == "free" for one in study.result.methods) > 0
    assert len(rows) + len(held) == len(study.result.methods) == 15
    assert {row[-1] for row in held} == {"no"}
    assert [row[0] for row in rows if row[-1] == "yes"] == [
        "Inertia J (kg·m²)",
        "Viscous damping B (N·m·s/rad)",
        "Stiffness K (N·m/rad)",
    ]
    assert "changes" not in page.sections
    changed = dataclasses.replace(study, changes=("sessions/M1-day-09: new",))
    assert "sessions/M1-day-09: new" in page_of(changed).words("changes")


def test_a_study_without_ratings_sensitivity_or_exclusions(study: Shown) -> None:
    page = page_of(bare(study))
    assert "nan" not in page.words().split()
    assert not {"ratings", "sensitivity", "excluded_epochs"} & set(page.sections)
    assert not any(name.startswith("Differences") for name in page.rows)


def test_a_measure_that_days_cannot_test_says_why(study: Shown) -> None:
    remark = "there is one day in each condition"

    def untested(one: Compared) -> Compared:
        if one.measure.name != "work_j":
            return one
        without = DayDifference(n_days_x=1, n_days_y=1, remark=remark)
        return dataclasses.replace(one, p=math.nan, remark=remark, statistic=without)

    page = page_of(altered(study, untested))
    (row,) = (r for r in page.table("DBS − OFF: days") if r[0].startswith("Work"))
    assert row[-1] == remark


def test_a_blinded_study_keeps_its_codes_and_shows_no_stimulation() -> None:
    blind = made_study(dataclasses.replace(SMALL, names=("a7", "k2")), blinded=True)
    page = page_of(blind)
    text = page.words()
    assert text.count("are codes") >= 3
    assert "k2 against a7" in " ".join(page.rows)
    assert not re.search(r"130 Hz|stimulation|0\.32 mA|\bOFF\b|\bDBS\b", text)


def test_the_test_by_days_is_said_in_words(page: ParsedPage) -> None:
    assert "Welch's t-test of 4 days of OFF and 3 days of DBS" in page.words("comparison")
    assert "Satterthwaite FE" in page.words("methods")
    study = made_study(dataclasses.replace(SMALL, both_on_a_day=True))
    page = page_of(study)
    assert "Paired t-test of 4 days. In brackets" in page.words("comparison")
    assert "by the means of the days: paired t-test of 4 days" in page.words("methods")
    words = "t-test paired by 4 days, with 5 days of OFF alone at weight 0.28"

    def said(one: Compared) -> Compared:
        return dataclasses.replace(
            one, test=words, statistic=dataclasses.replace(one.statistic, test=words)
        )

    page = page_of(altered(study, said))
    assert "T-test paired by 4 days, with 5 days of OFF alone" in page.words("comparison")
    assert f"{words}, with 95 % intervals. The weights follow from the" in page.words("methods")


def test_several_subjects_are_distinguished() -> None:
    design = Design((3, 3), (3, 3), (2, 2), subjects=("M1", "M2"), both_on_a_day=True)
    page = page_of(made_study(design))
    assert "2: M1, M2" in page.words("study")
    assert "6: 6 in OFF and 6 in DBS, 6 in both" in page.words("study")
    assert "In these two subjects, " in page.words()
    assert "J held at the median of the same subject" in page.words()


def test_one_condition_alone_has_a_page(study: Shown) -> None:
    page = page_of(of_result(bare(study), comparisons=(), values=(), effects={}))
    assert "No two conditions were compared." in page.words("comparison")
    assert "effects" not in page.sections


def test_special_characters_are_escaped(tmp_path: Path) -> None:
    design = dataclasses.replace(
        SMALL, names=(NASTY, "DBS"), subjects=(NASTY,), examiners=(NASTY, "B")
    )
    conditions = (Condition(NASTY, NASTY, electrodes=NASTY), Condition("DBS"))
    study = made_study(design, conditions=conditions)
    study = dataclasses.replace(study, title=NASTY, changes=(NASTY,))
    page = page_of(study)
    assert len(page.scripts) == 2  # its own: the traces, and what opens them
    assert not any("<script>" in script for script in page.scripts)
    assert page.text.count(NASTY) > 20


OWN = ("effects", "ratings", "sensitivity")
LONG = ("days", "distributions", "perturbation", "torque", "voluntary", "loops", "recorded")
"""Sections whose figures take long and have their own tests."""


def short_report(study: Shown, folder: Path) -> Path:
    with sections_without(LONG):
        return report(study, folder)


@pytest.fixture(scope="module")
def written(study: Shown, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return short_report(study, tmp_path_factory.mktemp("report") / "a")


def test_the_same_study_gives_the_same_bytes(study: Shown, written: Path, tmp_path: Path) -> None:
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


def test_virtual_data_say_so_in_every_figure(study: Shown, written: Path, tmp_path: Path) -> None:
    with sections_without({section.name for section in SECTIONS} - {*OWN}):
        virtual = report(of_study(study, virtual=True), tmp_path)
    assert len(list((tmp_path / "figures").glob("*.svg"))) == 3
    for name in OWN:
        one, other = (
            (page.parent / "figures" / f"{name}.svg").read_text() for page in (written, virtual)
        )
        assert ">virtual data</text>" not in one
        assert ">virtual data</text>" in other
