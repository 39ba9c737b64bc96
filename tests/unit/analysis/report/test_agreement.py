"""The page, the tables, the JSON and the terminal show the same numbers."""

import csv
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.unit.analysis.report.cohorts import Design, made_study, of_study
from tests.unit.analysis.report.parsed_page import ParsedPage, assert_shows, sections_without

from rigidimeter.analysis.reading import estimates_document
from rigidimeter.analysis.report import Shown, page_text, report, shown_tables
from rigidimeter.analysis.study import comparison_document, shown_cells, statements
from rigidimeter.cli.comparison_text import difference_blocks, full_blocks, statement_blocks
from rigidimeter.cli.terminal_tables import Block, Heading, Table
from rigidimeter.core.files import read_json, write_json
from rigidimeter.core.words import Column

DRAWN = ("distributions", "days", "perturbation", "torque", "voluntary", "loops", "impedance")

Row = dict[str, str]


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
    with sections_without(DRAWN):
        return report(study, tmp_path_factory.mktemp("report")).parent


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
        if title.startswith("Software"):
            body.pop()  # what the report adds: of what it is
        assert [[plain(cell) for cell in row] for row in table.rows] == body
        last = [heading.rpartition("\n") for heading in table.headings]
        heads = [plain(name) for group, _, name in last if group or not grouped]
        assert heads == cells[int(grouped)]
        if grouped:
            groups = dict.fromkeys(plain(group) for group, _, _ in last if group)
            assert [*groups] == [cell for cell in cells[0] if cell in groups]


def test_the_table_of_differences_is_one_on_page_and_terminal(study, json, page) -> None:
    """Each cell is that of `shown_cells`, and rounds the number of the document."""
    rows = [shown_cells(one) for one in study.result.comparisons]
    (terminal,) = difference_blocks(study.result, "DBS")
    strip = page.table("DBS against OFF")
    assert [plain(heading) for heading in strip[0]][:4] == ["Measure", "OFF", "DBS", "DBS − OFF"]
    assert [*terminal.headings[1:4]] == ["OFF", "DBS", "DBS − OFF"]
    found = json["comparison"]["conclusion"]
    for row, one, cells, line in zip(rows, found, strip[1:], terminal.rows, strict=True):
        shown = [
            row["reference"],
            row["other"],
            row["difference"],
            row["interval"],
            row["p"],
            row["verdict"],
        ]
        measure = f"{row['measure']}, {row['unit']}" if row["unit"] else row["measure"]
        assert [cells[0], *cells[1:5], *cells[6:8]] == [measure, *shown]
        reference, other, difference, simulated, interval, p, verdict = line[1:]
        assert line[0] == measure
        assert [reference, other, difference, interval, p, verdict] == shown
        assert simulated == row["simulated"] == ""
        factor = 1e3 if "10⁻³" in row["unit"] else 1.0
        assert_shows(row["reference"], [factor * one["value_reference"]], 3)
        assert_shows(row["other"], [factor * one["value_other"]], 3)
        part = "difference" if one["difference_percent"] is None else "difference_percent"
        assert (" %" in row["difference"]) == (part == "difference_percent")
        factor = factor if part == "difference" else 1.0
        sizes = [factor * one[f"{part}{end}"] for end in ("", "_low", "_high")]
        assert_rounds(f"{row['difference']} {row['interval']}", sizes)
        if one["role"] == "check":  # J is in no family
            assert row["p"] == "–"
        else:
            assert_shows(row["p"], [one["p_holm"]], 2)
        words = {"no difference shown": "none shown", "cannot be decided": "undecided"}
        assert row["verdict"] == words.get(one["verdict"], one["verdict"])


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
    named = [replace(one, simulated=simulated[one.name]) for one in study.study.conditions]
    virtual = made_study(
        Design(days=(4, 3), epochs=(4, 4), scores=(3, 3)), conditions=tuple(named), virtual=True
    )
    rows = [shown_cells(one) for one in virtual.result.comparisons]
    assert [row["simulated"] for row in rows] == ["−20 %", *[""] * 5]
    (terminal,) = difference_blocks(virtual.result, "DBS")
    assert terminal.headings[4] == "simulated"
    assert [line[4] for line in terminal.rows] == [row["simulated"] for row in rows]
    strip = ParsedPage(page_text(virtual)).table("DBS against OFF")
    assert strip[0][4] == "Simulated"
    assert [cells[4] for cells in strip[1:]] == ["−20 %", *["–"] * 5]
    document = comparison_document(virtual.result)["conclusion"]
    assert document[0]["simulated_difference_percent"] == pytest.approx(-20.0)
    assert "simulated_difference" not in document[1]


def test_statements_are_the_same_on_page_terminal_and_in_python(study, page) -> None:
    said = statements(study.study, study.result.comparisons)["DBS"]
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


def sizes_of(row: dict[str, Any], column: Column) -> Iterator[float]:
    """Yield the numbers that a cell of the page has, unrounded."""
    ends = (column.ends or ())[:: 1 if column.page_factor > 0 else -1]
    factor = 100.0 if column.kind == "percent" else column.page_factor
    for name in (column.name, *ends, *filter(None, [column.below])):
        value = row.get(name)
        if isinstance(value, int | float) and not math.isnan(value):
            yield value * (1.0 if name == column.below else factor)


def test_each_cell_of_the_page_rounds_a_number_of_its_table(study, page) -> None:
    digits = {"number": 2, "count": 15, "p": 2, "percent": 1}
    seen = 0
    for one in shown_tables(study):
        columns = one.shown_columns(several_sources=True)
        cells = page.table(one.title)[1 + any(column.group for column in columns) :]
        # The report adds to the provenance what it is of.
        for row, line in zip(one.rows, cells, strict=one.name != "provenance"):
            for column, cell in zip(columns, line, strict=True):
                if column.kind in digits and not column.error:
                    assert_shows(cell, [*sizes_of(row, column)], digits[column.kind])
                    seen += 1
    assert seen > 500


@pytest.mark.parametrize(
    ("table", "document", "place"),
    [
        *((name, "comparison", name) for name in ("conclusion", "effect_differences")),
        ("sensitivity", "comparison", "sensitivity"),
        ("comparisons", "comparison", "comparisons"),
        ("estimates", "estimates", "epochs"),
        ("scores", "estimates", "scores"),
    ],
)
def test_files_have_the_numbers_of_the_documents(
    json, folder: Path, table: str, document: str, place: str
) -> None:
    for row, one in zip(rows_of(folder, table), json[document][place], strict=True):
        assert_same(row, one)
        for side in one.get("groups", {}):
            name = "reference" if side == one["reference"] else "other"
            summary = {key: one["groups"][side][key] for key in ("median", "q1", "q3")}
            assert_same(row, {f"{key}_{name}": value for key, value in summary.items()})
        if days := one.get("days"):
            assert_same(row, {key: days[key] for key in ("estimate", "low", "p_holm")}, "days_")


def test_fits_with_j_held_and_of_all_epochs_are_in_the_files(json, folder: Path) -> None:
    held = json["estimates"]["fixed_inertia"]["epochs"]
    of_epoch = ("angle_rms_rad", "angle_range_rad")
    for row, one in zip(rows_of(folder, "estimates"), held, strict=True):
        assert_same(row, {k: v for k, v in one.items() if k not in of_epoch}, "fixed_inertia_")
    whole = json["estimates"]["pooled"]
    rows = rows_of(folder, "pooled")
    assert [row["condition"] for row in rows] == ["OFF", "DBS", "(all)"]
    for row, fit in zip(rows, [*whole["conditions"].values(), whole], strict=True):
        assert_same(row, fit)


def test_ratings(json, folder: Path, page: ParsedPage) -> None:
    found = json["comparison"]["ratings"]
    contrast, by_days = found["contrast"], found["contrast_days"]
    assert [float(row["p"]) for row in rows_of(folder, "rating_contrast")] == [
        contrast["p_residual"],
        contrast["p_satterthwaite"],
        contrast["p_kenward_roger"],
        by_days["p_kenward_roger"],
    ]
    for row in rows_of(folder, "rating_offsets"):
        assert float(row["offset"]) == found["offsets_by"][row["grouping"]][row["name"]]
    means = page.words("ratings").partition("intervals: ")[2]
    expected = [
        found[key][name] for name in ("OFF", "DBS") for key in ("means", "means_low", "means_high")
    ]
    assert_shows(means.partition(" Contrast")[0], expected, 3)
