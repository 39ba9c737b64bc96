"""The page, the tables, the JSON and the terminal show the same numbers."""

import csv
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

import pytest
from tests.unit.analysis.report.cohorts import Design, made_study, of_study
from tests.unit.analysis.report.parsed_page import ParsedPage

from rigidimeter.analysis.reading import Recording, estimates_document
from rigidimeter.analysis.report import SECTIONS, Shown, shown_tables
from rigidimeter.analysis.report import page as page_module
from rigidimeter.analysis.report.page import render_page, write_report
from rigidimeter.analysis.study_anew import comparison_document, difference_rows
from rigidimeter.cli.comparison_text import (
    difference_blocks,
    full_blocks,
    statement_blocks,
)
from rigidimeter.cli.estimate_text import estimate_blocks
from rigidimeter.cli.terminal_tables import Block, Heading, Table
from rigidimeter.core.files import read_json, write_json

NUMBER = re.compile(r"(?<![\w.])[−-]?\d+(?:\.\d+)?(?:·10[⁻⁰-⁹¹²³]+)?")
SHARED = re.compile(r"\[([^]]*)\](·10[⁻⁰-⁹¹²³]+)")
LOWERED = str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")
PARAMETERS = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
DRAWN = ("distributions", "days", "perturbation", "torque", "voluntary", "loops", "impedance")

Row = dict[str, str]


def numbers(text: str) -> list[float]:
    text = SHARED.sub(lambda all_: NUMBER.sub(rf"\g<0>{all_[2]}", all_[1]), text)
    return [float(found.replace("·10", "e").translate(LOWERED)) for found in NUMBER.findall(text)]


def assert_shows(text: str, values: Sequence[float | None], digits: int) -> None:
    """Assert that the text has these numbers in this order, rounded to so many digits or more."""
    expected = [value for value in values if value is not None]
    found = numbers(text)
    assert len(found) == len(expected), (text, expected)
    for one, value in zip(found, expected, strict=True):
        size = math.floor(math.log10(abs(value))) if value else 0
        assert abs(one - value) <= 0.501 * 10.0 ** (size - digits + 1), (text, expected)


@pytest.fixture(scope="module")
def study() -> Shown:
    made = made_study(Design(days=(4, 3), epochs=(4, 4), scores=(3, 3)))
    first = next(fit for fit in made.analysis.fits if fit.outcome.included)
    pooled = tuple(
        replace(first, source="pooled", epoch="pooled", condition=name, value=share * first.value)
        for name, share in (("OFF", 1.01), ("DBS", 0.87), ("", 0.93))
    )
    return of_study(made, analysis=replace(made.analysis, pooled=pooled))


@pytest.fixture(scope="module")
def json(study: Shown, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return both documents as they are read back from their files."""
    folder = tmp_path_factory.mktemp("json")
    write_json(folder / "comparison.json", comparison_document(study.result))
    write_json(folder / "estimates.json", estimates_document(study.analysis))
    return {name: read_json(folder / f"{name}.json") for name in ("comparison", "estimates")}


@pytest.fixture(scope="module")
def folder(study: Shown, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the written report, without the figures of the recordings, which take long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page_module, "SECTIONS", [s for s in SECTIONS if s.name not in DRAWN])
        return write_report(study, tmp_path_factory.mktemp("report")).parent


@pytest.fixture(scope="module")
def page(folder: Path) -> ParsedPage:
    return ParsedPage((folder / "report.html").read_text(encoding="utf-8"))


def plain(text: str) -> str:
    """Return a cell without its line breaks and unbroken spaces."""
    return " ".join(text.split())


def tables_of(blocks: Iterable[Block]) -> list[tuple[str, Table]]:
    """Return the tables of the terminal with their headings, in their order."""
    found = []
    heading = ""
    for block in blocks:
        if isinstance(block, Heading):
            heading = str(block)
        elif isinstance(block, Table):
            found.append((heading, block))
    return found


def rows_of(folder: Path, table: str) -> list[Row]:
    with (folder / "tables" / f"{table}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def assert_same(row: Row, values: dict[str, Any], prefix: str = "") -> None:
    """Assert that the cells of a CSV are the numbers of a JSON object, to the last digit."""
    compared = [name for name, value in values.items() if isinstance(value, float)]
    assert compared
    for name in compared:
        assert float(row[prefix + name]) == values[name], name


@pytest.mark.parametrize("by_epoch", [False, True], ids=["compare", "estimate"])
def test_the_terminal_has_the_tables_of_the_page_cell_for_cell(study, page, by_epoch: bool) -> None:
    """In the order of the page; `estimate` also those with a row for each epoch."""
    shown = tables_of(full_blocks(study, by_epoch=by_epoch))
    long = [
        t for t in shown_tables(study) if t.folding and "Epoch" in [c.heading for c in t.columns]
    ]
    assert len(long) == 5
    titles = [title for title, _ in shown]
    for one in long:
        assert (one.title in titles) == by_epoch
    captions = [caption for caption in page.rows if " tables/" in caption]
    on_page = [caption.rpartition(" tables/")[0] for caption in captions]
    drawn = [title for title in titles if title not in on_page]
    assert [t for t in titles if t not in drawn] == [
        title for title in on_page if by_epoch or title not in {one.title for one in long}
    ]
    assert len(drawn) < 3  # of the sections of figures, which this page is made without
    for title, table in shown:
        if title in drawn:
            continue
        cells = page.table(title)
        grouped = any("\n" in heading for heading in table.headings)
        body = cells[1 + grouped :]
        assert [[plain(cell) for cell in row] for row in table.rows] == body
        last = [heading.rpartition("\n") for heading in table.headings]
        heads = [plain(name) for group, _, name in last if group or not grouped]
        assert heads == cells[int(grouped)]
        if grouped:
            groups = dict.fromkeys(plain(group) for group, _, _ in last if group)
            assert [*groups] == [cell for cell in cells[0] if cell in groups]


def test_the_table_of_differences_is_one_on_page_and_terminal(study, json, page) -> None:
    """Each cell is that of `difference_rows`, and rounds the number of the document."""
    rows = difference_rows(study.result.comparisons)
    (terminal,) = difference_blocks(study.result, "DBS")
    strip = page.table("DBS against OFF")
    assert [plain(heading) for heading in strip[0]][:4] == ["Measure", "OFF", "DBS", "DBS − OFF"]
    assert [*terminal.headings[1:4]] == ["OFF", "DBS", "DBS − OFF"]
    found = json["comparison"]["conclusion"]
    for row, one, cells, line in zip(rows, found, strip[1:], terminal.rows, strict=True):
        shown = [row.reference, row.other, row.difference, row.interval, row.p, row.verdict]
        measure = f"{row.measure}, {row.unit}" if row.unit else row.measure
        assert [cells[0], *cells[1:5], *cells[6:8]] == [measure, *shown]
        reference, other, difference, simulated, interval, p, verdict = line[1:]
        assert line[0] == measure
        assert [reference, other, difference, interval, p, verdict] == shown
        assert simulated == row.simulated == ""
        factor = 1e3 if "10⁻³" in row.unit else 1.0
        assert_shows(row.reference, [factor * one["value_reference"]], 3)
        assert_shows(row.other, [factor * one["value_other"]], 3)
        part = "difference" if one["difference_percent"] is None else "difference_percent"
        assert (" %" in row.difference) == (part == "difference_percent")
        factor = factor if part == "difference" else 1.0
        sizes = [factor * one[f"{part}{end}"] for end in ("", "_low", "_high")]
        assert_rounds(f"{row.difference} {row.interval}", sizes)
        if one["role"] == "check":  # J is in no family
            assert row.p == "–"
        else:
            assert_shows(row.p, [one["p_holm"]], 2)
        words = {"no difference shown": "none shown", "cannot be decided": "undecided"}
        assert row.verdict == words.get(one["verdict"], one["verdict"])


def assert_rounds(text: str, values: Sequence[float]) -> None:
    """Assert that a text has these numbers, signed, each to one place of all."""
    found = re.findall(r"[+−]?\d+(?:\.\d+)?", text)
    places = {len(one.partition(".")[2]) for one in found}
    assert len(found) == len(values)
    assert len(places) == 1
    for one, value in zip(found, values, strict=True):
        assert abs(float(one.replace("−", "-")) - value) <= 0.501 * 10.0 ** -places.copy().pop()
        assert one[0] in "+−" or not float(one)


def test_simulated_differences_stand_beside_those_found(study) -> None:
    """Of a virtual study, on terminal, page and in the document."""
    simulated = {"OFF": {"stiffness_nm_rad": 1.75}, "DBS": {"stiffness_nm_rad": 1.4}}
    conditions = (replace(c, simulated=simulated[c.name]) for c in study.study.conditions)
    design = Design(days=(4, 3), epochs=(4, 4), scores=(3, 3))
    virtual = made_study(design, conditions=tuple(conditions))
    rows = difference_rows(virtual.result.comparisons)
    assert [row.simulated for row in rows] == ["−20 %", *[""] * 5]
    (terminal,) = difference_blocks(virtual.result, "DBS")
    assert terminal.headings[4] == "simulated"
    assert [line[4] for line in terminal.rows] == [row.simulated for row in rows]
    strip = ParsedPage(render_page(virtual, (), {})).table("DBS against OFF")
    assert strip[0][4] == "Simulated"
    assert [cells[4] for cells in strip[1:]] == ["−20 %", *["–"] * 5]
    document = comparison_document(virtual.result)["conclusion"]
    assert document[0]["simulated_difference_percent"] == pytest.approx(-20.0)
    assert "simulated_difference" not in document[1]


def test_statements_are_the_same_on_page_terminal_and_in_python(study, page) -> None:
    said = study.result.statements
    (terminal,) = statement_blocks(study.result, "DBS")
    assert [*terminal.rows] == [
        ("measured", said.measured),
        ("tested", said.tested),
        *zip(("concluded", *[""] * len(said.concluded)), said.concluded, strict=False),
    ]
    on_page = page.words()
    for sentence in (said.measured, said.tested, *said.concluded):
        assert on_page.count(sentence) == 1
    assert on_page.index(said.measured) < on_page.index(said.tested)
    assert on_page.index(said.tested) < on_page.index(said.concluded[0])


def test_comparisons_over_epochs(json, folder: Path, page: ParsedPage) -> None:
    shown = page.table("DBS − OFF: each epoch counted")[2:]
    for c, row, cells in zip(
        json["comparison"]["comparisons"], rows_of(folder, "comparisons"), shown, strict=True
    ):
        assert row["measure"] == c["measure"]
        test = {name: c[name] for name in ("shift", "shift_low", "shift_high", "z", "p", "p_holm",
                                           "r", "r_low", "r_high", "rank_biserial")}  # fmt: skip
        assert_same(row, test)
        for side, name in (("reference", "OFF"), ("other", "DBS")):
            group = c["groups"][name]
            summary = ("median", "q1", "q3", "sd_percent")
            assert_same(row, {f"{key}_{side}": group[key] for key in summary})
        # The keys of a rank-sum test are reference − other; people see other − reference.
        assert_shows(cells[7], [-c["shift"], -c["shift_high"], -c["shift_low"]], 3)
        assert_shows(cells[8], [-c["z"]], 3)
        assert_shows(cells[9], [-c["r"]], 2)
        assert_shows(cells[10], [c["p"], c["p_holm"]], 2)
        for (cell, sd), name in ((cells[2:4], "OFF"), (cells[5:7], "DBS")):
            assert_shows(cell, [c["groups"][name][key] for key in ("median", "q1", "q3")], 3)
            assert_shows(sd, [c["groups"][name]["sd_percent"]], 2)


def test_comparisons_by_days(json, folder: Path, page: ParsedPage) -> None:
    shown = page.table("DBS − OFF: days counted")[1:]
    for c, row, cells in zip(
        json["comparison"]["comparisons"], rows_of(folder, "comparisons"), shown, strict=True
    ):
        days = c["days"]
        names = ("estimate", "low", "high", "p", "p_holm", "df", "p_days", "day_share")
        assert_same(row, {name: days[name] for name in names}, "days_")
        assert_shows(cells[1], [-days["estimate"], -days["high"], -days["low"]], 4)
        assert_shows(cells[4], [days["df"]], 4)
        assert_shows(cells[5], [days["p"], days["p_holm"]], 2)
        assert_shows(cells[6], [days["p_days"]], 2)
        if days["day_share"] is None:
            assert cells[7] == "–"
        else:
            assert_shows(cells[7], [float(f"{100 * days['day_share']:.0f}")], 2)


def test_differences_between_effects(json, folder: Path, page: ParsedPage) -> None:
    shown = page.table("Differences between effect sizes")[1:]
    for d, row, cells in zip(
        json["comparison"]["effect_differences"],
        rows_of(folder, "effect_differences"),
        shown,
        strict=True,
    ):
        assert (row["first"], row["second"]) == (d["first"], d["second"])
        assert_same(row, d)
        assert_shows(cells[2], [d["estimate"], d["low"], d["high"]], 4)
        assert_shows(cells[3], [d["p"]], 2)
        assert_shows(cells[4], [d["p_holm"]], 2)


def test_ratings(json, folder: Path, page: ParsedPage) -> None:
    found = json["comparison"]["ratings"]
    contrast, by_days = found["contrast"], found["contrast_days"]
    shown = page.table("Contrast of the ratings")[1:]
    rows = rows_of(folder, "rating_contrast")
    for row, cells in zip(rows, shown, strict=True):
        assert_shows(cells[1], [float(row[name]) for name in ("estimate", "low", "high")], 4)
        assert_shows(cells[-1], [float(row["p"])], 2)
    assert [float(row["p"]) for row in rows] == [
        contrast["p_residual"],
        contrast["p_satterthwaite"],
        contrast["p_kenward_roger"],
        by_days["p_kenward_roger"],
    ]
    for row in rows_of(folder, "rating_offsets"):
        assert float(row["offset"]) == found["offsets_by"][row["grouping"]][row["name"]]
    means = page.words("ratings").partition("intervals: ")[2]
    expected = []
    for name in ("OFF", "DBS"):
        expected += [found[key][name] for key in ("means", "means_low", "means_high")]
    assert_shows(means.partition(" Contrast")[0], expected, 3)


def test_sensitivity(json, folder: Path, page: ParsedPage) -> None:
    shown = {
        "free": iter(page.table("The shift by each method")[1:]),
        "fixed": iter(page.table("The shift with J held at its median")[1:]),
    }
    for s, row in zip(
        json["comparison"]["sensitivity"], rows_of(folder, "sensitivity"), strict=True
    ):
        cells = next(shown[s["inertia"]])
        assert (row["measure"], row["method"], row["inertia"]) == (
            s["measure"],
            s["method"],
            s["inertia"],
        )
        assert_same(row, s)
        assert_shows(cells[4], [-s["shift"], -s["shift_high"], -s["shift_low"]], 4)
        assert_shows(cells[6], [s["p"]], 2)
        assert_shows(cells[7], [s["p_day"]], 2)
    assert not any(any(rest) for rest in shown.values())


def test_estimates_of_every_epoch(json, folder: Path, page: ParsedPage) -> None:
    epochs, fixed = json["estimates"]["epochs"], json["estimates"]["fixed_inertia"]["epochs"]
    rows = rows_of(folder, "estimates")
    free = page.table("Inertia, damping and stiffness, epoch by epoch")
    held = page.table("Damping and stiffness with the inertia fixed")
    for place, (one, two, row) in enumerate(zip(epochs, fixed, rows, strict=True)):
        assert (row["source"], row["epoch"]) == (one["source"], one["epoch"])
        assert_same(row, one)
        motion = {name: two[name] for name in ("angle_rms_rad", "angle_range_rad")}
        assert_same(row, motion)  # that of the epoch
        assert_same(row, {k: v for k, v in two.items() if k not in motion}, "fixed_inertia_")
        for table, found in ((free, one), (held, two)):
            for name, symbol in zip(PARAMETERS, "JBK", strict=True):
                heading = next(
                    k for k, text in enumerate(table[0]) if text.startswith(f"{symbol} ")
                )
                ends = [found[name], found[f"{name}_low"], found[f"{name}_high"]]
                assert_shows(table[1 + place][heading], ends, 4)


def first_screen(study: Shown, column: str) -> list[Sequence[str]]:
    """Return the rows of the table of the first screen of `estimate` with this first heading."""
    read = Recording(study.epochs, (), study.study.settings, ())
    for _, table in tables_of(estimate_blocks(read, study.analysis)):
        if table.headings and table.headings[0] == column:
            return [row for row in table.rows if not isinstance(row, str)]
    raise AssertionError(column)


def test_the_first_screen_of_estimates_has_the_numbers_of_the_document(study, json) -> None:
    """Value ± standard error to two digits of the error: the first four epochs, and the last."""
    epochs = json["estimates"]["epochs"]
    assert len(epochs) > 8
    fits = tuple(replace(fit, source="x.csv") for fit in study.analysis.fits)
    analysis = replace(study.analysis, fits=fits, fixed_inertia=fits, scores=())
    shown = first_screen(of_study(study, analysis=analysis), "epoch")[:6]
    assert first_screen(study, "epoch")[0][0] == "together"  # of several recordings
    assert shown[4][0] == "…"
    for row, one in zip([*shown[:4], shown[5]], [*epochs[:4], epochs[-1]], strict=True):
        assert row[0] == one["epoch"]
        assert row[1] == one["condition"]
        for name, cell in zip(PARAMETERS, row[2:5], strict=True):
            factor = 1e3 if name == "inertia_kg_m2" else 1.0
            value, error = (factor * one[key] for key in (name, f"{name}_se"))
            found, spread = numbers(cell)
            size = 10.0 ** (math.floor(math.log10(error)) - 1)
            assert abs(found - value) <= 0.51 * size
            assert abs(spread - error) <= 0.51 * size
            decimals = [len(part.partition(".")[2]) for part in cell.split(" ± ")]
            assert decimals[0] == decimals[1]
        assert_shows(row[5], [math.degrees(one["angle_rms_rad"])], 3)
        assert_shows(row[6], [one["vaf_percent"]], 3)
        assert row[7] == ("" if one["outcome"] == "included" else one["outcome"])


def test_the_first_screen_has_all_epochs_together(study, json) -> None:
    """Value, 95 % interval and SD between epochs of each condition."""
    pooled = json["estimates"]["pooled"]["conditions"]
    rows = first_screen(study, "epoch")
    for name in ("OFF", "DBS"):
        begin = next(k for k, row in enumerate(rows) if row[:2] == ("together", name))
        value, ends, sd = rows[begin : begin + 3]
        assert (ends[0], sd[0]) == ("95 %", "SD")
        own = [
            one
            for one in json["estimates"]["epochs"]
            if one["condition"] == name and one["outcome"] == "included"
        ]
        for k, parameter in enumerate(PARAMETERS, start=2):
            factor = 1e3 if parameter == "inertia_kg_m2" else 1.0
            sizes = [factor * pooled[name][f"{parameter}{end}"] for end in ("", "_low", "_high")]
            for one, size in zip(numbers(f"{value[k]} {ends[k]}"), sizes, strict=True):
                places = len(value[k].partition(".")[2])
                assert abs(one - size) <= 0.501 * 10.0**-places
            each = [one[parameter] for one in own]
            assert_shows(sd[k], [100 * stdev(each) / fmean(each)], 2)


def test_scores_of_every_epoch(json, folder: Path, page: ParsedPage) -> None:
    shown = page.table("Scores of the epochs")
    columns = [shown[0].index(next(h for h in shown[0] if h.startswith(name)))
               for name in ("Angular impulse", "Work", "Cycles", "Frequency")]  # fmt: skip
    for score, row, cells in zip(
        json["estimates"]["scores"], rows_of(folder, "scores"), shown[1:], strict=True
    ):
        assert (row["source"], row["epoch"]) == (score["source"], score["epoch"])
        assert_same(row, score)
        values = [score[name] for name in ("impulse_nm_s", "work_j", "n_cycles", "frequency_hz")]
        for column, value in zip(columns, values, strict=True):
            assert_shows(cells[column], [value], 4)


def test_pooled_estimates(json, folder: Path, page: ParsedPage) -> None:
    whole = json["estimates"]["pooled"]
    found = {**whole["conditions"], "all": whole}
    shown = page.table("All epochs of a condition together")
    rows = rows_of(folder, "pooled")
    assert [row["condition"] for row in rows] == ["OFF", "DBS", "(all)"]
    for place, (fit, row) in enumerate(zip(found.values(), rows, strict=True)):
        assert_same(row, fit)
        for k, parameter in enumerate(PARAMETERS):
            ends = [fit[parameter], fit[f"{parameter}_low"], fit[f"{parameter}_high"]]
            assert_shows(shown[1 + place][1 + k], ends, 4)
