"""The page of a study folder: its numbers are those of the cohort, and any part may be missing."""

import dataclasses
import math
import re
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path

import pytest
from tests.unit.reporting.cohorts import Design, altered, made_study, untested

from rigidimeter.reporting import page as page_module
from rigidimeter.reporting import write_report
from rigidimeter.reporting.numbers import interval, number, p_value
from rigidimeter.reporting.page import DRAWN, render_page
from rigidimeter.reporting.report_tables import all_tables
from rigidimeter.study import Condition, StudyResult

SMALL = Design(days=(4, 3), epochs=(4, 4), scores=(3, 3))
NASTY = "<script>alert('x')</script>&amp;\"$_$"


class Tables(HTMLParser):
    """The text of a page, and the cells of every table by its caption."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: set[str] = set()
        self.text = ""
        self.rows: dict[str, list[list[str]]] = {}
        self._caption = ""
        self._inside = ""
        self._sections: list[str] = []
        self.sections: dict[str, str] = {}
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        if tag == "section":
            self._sections.append(dict(attrs)["id"] or "")
        if tag == "caption":
            self._caption, self._inside = "", "caption"
        elif tag == "tr":
            self.rows.setdefault(self._caption.strip(), []).append([])
        elif tag in ("td", "th"):
            self.rows[self._caption.strip()][-1].append("")
            self._inside = "cell"
        elif tag == "br" and self._inside == "cell":
            self.rows[self._caption.strip()][-1][-1] += " "

    def handle_endtag(self, tag: str) -> None:
        if tag in ("caption", "td", "th"):
            self._inside = ""
        if tag == "section":
            self._sections.pop()

    def handle_data(self, data: str) -> None:
        self.text += data
        if self._sections:
            place = self._sections[-1]
            self.sections[place] = self.sections.get(place, "") + data
        if self._inside == "caption":
            self._caption += data
        elif self._inside == "cell":
            self.rows[self._caption.strip()][-1][-1] += data

    def table(self, caption: str) -> list[list[str]]:
        (found,) = (rows for name, rows in self.rows.items() if name.startswith(caption))
        return [[" ".join(cell.split()) for cell in row] for row in found]


def shown(study: StudyResult) -> Tables:
    """Return the page without any figure, which is quick."""
    none: Mapping[str, list] = {group: [] for group in DRAWN}
    return Tables(render_page(study, all_tables(study), none))


def words(page: Tables, section: str = "") -> str:
    return " ".join((page.sections[section] if section else page.text).split())


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


@pytest.fixture(scope="module")
def page(study: StudyResult) -> Tables:
    return shown(study)


def test_the_main_table_has_epochs_and_days_of_every_measure(
    study: StudyResult, page: Tables
) -> None:
    rows = {row[0].rpartition(" ")[0]: row for row in page.table("OFF against DBS")[2:]}
    assert len(rows) == 6
    for c in study.comparisons[:-1]:
        row = rows[c.measure.title]
        test, summary, day = c.test, c.summaries["OFF"], c.days
        assert test is not None
        assert day is not None
        quartiles = interval(summary.q1, summary.q3, 3)
        out = f"{summary.n} ({c.excluded['OFF']})"
        assert row[1] == f"{number(summary.median, 3)} {quartiles} {out}"
        shift = interval(test.shift_low, test.shift_high, 3)
        assert row[3].startswith(f"{number(test.shift, 3)} {shift}")
        assert row[4] == f"{number(test.z, 3)} {test.r:.2f}".replace("-", "−")
        assert row[5] == f"{p_value(test.p)} ({p_value(c.p_holm)})"
        assert row[6].startswith(f"{number(day.estimate, 3)} {interval(day.low, day.high, 3)}")
        assert f"{day.n_days_x} and {day.n_days_y} days" in row[6]
        assert row[7] == f"{p_value(day.p)} ({p_value(c.days_p_holm)})"
        assert row[8] == p_value(day.p_days)
        assert row[9] == f"{100 * day.day_share:.0f} %"


def test_ratings_stand_in_the_main_table_with_their_own_model(
    study: StudyResult, page: Tables
) -> None:
    found = study.ratings
    assert found is not None
    assert found.contrast_days is not None
    (row,) = (r for r in page.table("OFF against DBS") if r[0].startswith("Examiners"))
    assert row[6].startswith(number(found.contrast_days.estimate, 3))
    assert row[7].startswith(p_value(found.contrast_days.p_kenward_roger))
    contrast = page.table("Contrast of the ratings, OFF − DBS")
    assert [row[-1] for row in contrast[1:]] == [
        p_value(found.contrast.p_residual),
        p_value(found.contrast.p_satterthwaite),
        p_value(found.contrast.p_kenward_roger),
        p_value(found.contrast_days.p_kenward_roger),
    ]
    offsets = {row[1]: row[3] for row in page.table("Offsets")[1:]}
    assert offsets == {name: number(b) for name, b in found.fit.offsets["examiner"].items()}


def test_differences_between_effects_are_all_told(study: StudyResult, page: Tables) -> None:
    rows = page.table("Differences between effect sizes")[1:]
    assert len(rows) == len(study.differences) == 15
    for row, pair in zip(rows, study.differences, strict=True):
        assert row[2].startswith(number(pair.difference.estimate))
        assert row[3:5] == [p_value(pair.difference.p), p_value(pair.p_holm)]


def test_the_head_tells_days_conditions_and_stimulation(page: Tables) -> None:
    text = words(page, "study")
    assert "Subjects1: M1" in text.replace("Subjects 1", "Subjects1")
    assert "7: 4 in OFF and 3 in DBS" in text
    row = page.table("Conditions")[2]
    assert row == ["DBS", "stimulation on", "130", "0.32", "mA", "60", "C+ 1-", "15", "3", "3"]
    assert "The recordings" in page.text


def test_every_excluded_epoch_is_there_and_the_account_balances(
    study: StudyResult, page: Tables
) -> None:
    rows = page.table("Epochs that do not count: who said so, and why")[1:]
    assert len(rows) == len(study.exclusions) == 3
    assert {row[6] for row in rows} == {"protocol", "operator"}
    for row in page.table("Every recorded epoch, counted once")[1:]:
        recorded, *parts = (int(cell) for cell in row[2:])
        assert recorded == sum(parts)
        assert parts[-1] == 0
    assert "neither included nor listed" not in words(page)


def test_an_epoch_that_vanished_is_cried_out(study: StudyResult) -> None:
    fewer = dataclasses.replace(study, exclusions=study.exclusions[1:])
    text = words(shown(fewer), "exclusions")
    assert "1 recorded epoch is neither included nor listed as left out" in text


def test_sensitivity_and_changes(study: StudyResult, page: Tables) -> None:
    rows = page.table("The shift by other methods")[1:]
    assert len(rows) == len(study.sensitivity) == 15
    assert [row[0] for row in rows if row[-1] == "yes"] == [
        "Inertia J",
        "Viscous damping B",
        "Stiffness K",
    ]
    assert "No change is known." in words(page, "changes")
    told = made_study(SMALL, changes=("sessions/M1-day-09: new",))
    assert "sessions/M1-day-09: new" in words(shown(told), "changes")


def test_a_study_without_ratings_sensitivity_or_exclusions() -> None:
    bare = made_study(SMALL, ratings=None, sensitivity=(), exclusions=(), differences=())
    page = shown(bare)
    text = words(page)
    assert "The study has no ratings." in text
    assert "The conclusions were not computed by another method." in text
    assert "No epoch was excluded." in text
    assert "nan" not in text.split()
    assert not any(name.startswith("Differences") for name in page.rows)


def test_a_measure_that_days_cannot_test_says_why(study: StudyResult) -> None:
    page = shown(untested(study, "work_j", "there is one day in each condition"))
    (row,) = (r for r in page.table("OFF against DBS") if r[0].startswith("Work"))
    assert row[-1] == "there is one day in each condition"
    assert "Not tested by days: work." in words(page)


def test_a_blinded_study_keeps_its_codes_and_tells_no_stimulation() -> None:
    blind = made_study(dataclasses.replace(SMALL, names=("a7", "k2")), blinded=True)
    page = shown(blind)
    text = words(page)
    assert text.count("conditions are codes") >= 3
    assert "a7 against k2" in " ".join(page.rows)
    assert not re.search(r"130 Hz|stimulation|0\.32 mA|\bOFF\b|\bDBS\b", text)


@pytest.mark.parametrize(("both", "one", "told"), [(1, 1, True), (1, 0, False), (0, 1, False)])
def test_one_offset_a_day_is_told_where_days_have_both(both: bool, one: bool, told: bool) -> None:
    study = made_study(dataclasses.replace(SMALL, both_on_a_day=bool(both)))
    if one:
        study = altered(
            study,
            lambda c: dataclasses.replace(c, days=dataclasses.replace(c.days, offsets=("day",))),
        )
    sentence = "A day was taken to move both its conditions alike."
    assert (sentence in words(shown(study))) is told


def test_several_subjects_are_distinguished() -> None:
    design = Design((3, 3), (3, 3), (2, 2), subjects=("M1", "M2"), both_on_a_day=True)
    page = shown(made_study(design))
    assert "2: M1, M2" in words(page, "study")
    assert "6: 6 in OFF and 6 in DBS, 6 in both" in words(page, "study")
    assert "an offset for each subject, each day and each condition within a day" in words(
        page, "comparison"
    )
    assert "J held at its median over all included epochs of the same subject" in words(page)


def test_one_condition_alone_has_a_page() -> None:
    study = dataclasses.replace(
        made_study(SMALL), comparisons=(), differences=(), ratings=None, sensitivity=()
    )
    page = shown(study)
    assert "No two conditions were compared." in words(page, "comparison")
    assert "No effect size could be computed." in words(page, "effects")


def test_special_characters_are_escaped(tmp_path: Path) -> None:
    design = dataclasses.replace(
        SMALL, names=(NASTY, "DBS"), subjects=(NASTY,), examiners=(NASTY, "B")
    )
    study = made_study(design, changes=(NASTY,))
    conditions = (Condition(NASTY, NASTY, electrodes=NASTY), Condition("DBS"))
    study = dataclasses.replace(study, title=NASTY, conditions=conditions)
    page = shown(study)
    assert "script" not in page.tags
    assert page.text.count(NASTY) > 20


OWN = ("effects", "ratings", "sensitivity")


def test_the_same_cohort_gives_the_same_bytes(
    study: StudyResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The other figures have their own test, and take long.
    drawn = {name: draw if name in OWN else (lambda _: []) for name, draw in DRAWN.items()}
    monkeypatch.setattr(page_module, "DRAWN", drawn)
    first = write_report(study, tmp_path / "a")
    again = write_report(study, tmp_path / "b")
    files = [path for path in first.parent.rglob("*") if path.is_file()]
    names = {path.relative_to(first.parent).as_posix() for path in files}
    assert {"methods.txt", "tables/comparisons.csv", "tables/account.csv"} <= names
    assert {f"figures/{name}.svg" for name in OWN} <= names
    for path in files:
        assert (again.parent / path.relative_to(first.parent)).read_bytes() == path.read_bytes()
    text = first.read_text(encoding="utf-8")
    assert text.count("data:image/svg+xml") == sum(name.endswith("svg") for name in names)
    assert not re.search(r"url\(|@import|https?:", text)


def test_no_number_is_rounded_in_the_files(study: StudyResult) -> None:
    tables = all_tables(study)
    table = tables["comparisons"]
    place = [column.name for column in table.columns].index("days_estimate")
    estimates = [row[place] for row in table.rows]
    assert estimates == [c.days.estimate for c in study.comparisons if c.days]
    assert not any(isinstance(cell, float) and math.isinf(cell) for cell in estimates)
