"""The page, the tables, the JSON and the terminal show the same numbers."""

import csv
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tests.unit.analysis.report.cohorts import Design, made_study
from tests.unit.analysis.report.parsed_page import ParsedPage

from rigidimeter.analysis.reading import estimates_document
from rigidimeter.analysis.report import SECTIONS
from rigidimeter.analysis.report import page as page_module
from rigidimeter.analysis.report.page import write_report
from rigidimeter.analysis.study import StudyResult, comparison_document
from rigidimeter.cli.comparison_text import comparison_blocks
from rigidimeter.cli.estimate import estimate_blocks
from rigidimeter.cli.terminal_tables import Block, Table, text_lines
from rigidimeter.core.files import read_json, write_json

NUMBER = re.compile(r"(?<![\w.])[−-]?\d+(?:\.\d+)?(?:e[+-]\d+)?")
PARAMETERS = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
DRAWN = ("distributions", "days", "perturbation", "torque", "voluntary", "loops", "impedance")

Row = dict[str, str]


def numbers(text: str) -> list[float]:
    return [float(found.replace("−", "-")) for found in NUMBER.findall(text)]


def assert_shows(text: str, values: Sequence[float | None], digits: int) -> None:
    """Assert that the text has these numbers in this order, rounded to so many digits or more."""
    expected = [value for value in values if value is not None]
    found = numbers(text)
    assert len(found) == len(expected), (text, expected)
    for one, value in zip(found, expected, strict=True):
        size = math.floor(math.log10(abs(value))) if value else 0
        assert abs(one - value) <= 0.501 * 10.0 ** (size - digits + 1), (text, expected)


@pytest.fixture(scope="module")
def study() -> StudyResult:
    made = made_study(Design(days=(4, 3), epochs=(4, 4), scores=(3, 3)))
    first = made.analysis.fits[0]
    pooled = tuple(
        replace(first, source="pooled", epoch="pooled", condition=name, value=share * first.value)
        for name, share in (("OFF", 1.01), ("DBS", 0.87), ("", 0.93))
    )
    return replace(made, analysis=replace(made.analysis, pooled=pooled))


@pytest.fixture(scope="module")
def json(study: StudyResult, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return both documents as they are read back from their files."""
    folder = tmp_path_factory.mktemp("json")
    write_json(folder / "comparison.json", comparison_document(study))
    write_json(folder / "estimates.json", estimates_document(study.analysis))
    return {name: read_json(folder / f"{name}.json") for name in ("comparison", "estimates")}


@pytest.fixture(scope="module")
def folder(study: StudyResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the written report, without the figures of the recordings, which take long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page_module, "SECTIONS", [s for s in SECTIONS if s.name not in DRAWN])
        return write_report(study, tmp_path_factory.mktemp("report")).parent


@pytest.fixture(scope="module")
def page(folder: Path) -> ParsedPage:
    return ParsedPage((folder / "report.html").read_text(encoding="utf-8"))


def cells_below(blocks: Iterable[Block], heading: str) -> list[Sequence[str]]:
    """Return the rows of the table that a heading of the terminal announces."""
    announced = False
    for block in blocks:
        if announced and isinstance(block, Table):
            return [row for row in block.rows if not isinstance(row, str)]
        announced |= isinstance(block, str) and block.startswith(heading)
    raise AssertionError(heading)


def rows_of(folder: Path, table: str) -> list[Row]:
    with (folder / "tables" / f"{table}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def assert_same(row: Row, values: dict[str, Any], prefix: str = "") -> None:
    """Assert that the cells of a CSV are the numbers of a JSON object, to the last digit."""
    compared = [name for name, value in values.items() if isinstance(value, float)]
    assert compared
    for name in compared:
        assert float(row[prefix + name]) == values[name], name


def test_comparisons_over_epochs(study, json, folder: Path, page: ParsedPage) -> None:
    blocks = list(comparison_blocks(study))
    shown = page.table("OFF against DBS: each epoch counted")[2:]
    conditions = cells_below(blocks, "Each condition")
    tests = cells_below(blocks, "OFF − DBS, Wilcoxon")
    for place, (c, row, cells) in enumerate(
        zip(json["comparison"]["comparisons"], rows_of(folder, "comparisons"), shown, strict=True)
    ):
        assert row["measure"] == c["measure"]
        test = {name: c[name] for name in ("shift", "shift_low", "shift_high", "z", "p", "p_holm",
                                           "r", "r_low", "r_high", "rank_biserial")}  # fmt: skip
        assert_same(row, test)
        for side, name in (("reference", "OFF"), ("other", "DBS")):
            group = c["groups"][name]
            summary = ("median", "q1", "q3", "sd_percent")
            assert_same(row, {f"{key}_{side}": group[key] for key in summary})
        assert_shows(cells[7], [c["shift"], c["shift_low"], c["shift_high"]], 3)
        assert_shows(cells[8], [c["z"]], 3)
        assert_shows(cells[9], [c["r"]], 2)
        assert_shows(cells[10], [c["p"], c["p_holm"]], 2)
        for (cell, sd), name in ((cells[2:4], "OFF"), (cells[5:7], "DBS")):
            assert_shows(cell, [c["groups"][name][key] for key in ("median", "q1", "q3")], 3)
            assert_shows(sd, [c["groups"][name]["sd_percent"]], 2)
        for name, terminal in zip(("OFF", "DBS"), conditions[2 * place :], strict=False):
            group = c["groups"][name]
            assert terminal[0] == name
            assert_shows(" ".join(terminal[3:5]), [group[k] for k in ("median", "q1", "q3")], 4)
            assert_shows(terminal[5], [group["sd_percent"]], 2)
        title, shift, ends, z, p, p_holm, r = tests[place]
        assert title == c["title"]
        assert_shows(f"{shift} {ends}", [c["shift"], c["shift_low"], c["shift_high"]], 4)
        assert_shows(f"{p} {p_holm}", [c["p"], c["p_holm"]], 2)
        assert_shows(f"{z} {r}", [c["z"], c["r"]], 2)


def test_comparisons_by_days(study, json, folder: Path, page: ParsedPage) -> None:
    shown = page.table("OFF against DBS: days counted")[1:]
    for c, row, cells, terminal in zip(
        json["comparison"]["comparisons"],
        rows_of(folder, "comparisons"),
        shown,
        cells_below(comparison_blocks(study), "OFF − DBS: days, not epochs"),
        strict=True,
    ):
        days = c["days"]
        names = ("estimate", "low", "high", "p", "p_holm", "df", "p_days", "day_share")
        assert_same(row, {name: days[name] for name in names}, "days_")
        assert_shows(cells[1], [days["estimate"], days["low"], days["high"]], 4)
        assert_shows(cells[5], [days["p"], days["p_holm"]], 2)
        assert_shows(cells[6], [days["p_days"]], 2)
        _, estimate, ends, p, p_holm, df, medians, share = terminal
        assert_shows(f"{estimate} {ends}", [days["estimate"], days["low"], days["high"]], 4)
        assert_shows(f"{p} {p_holm}", [days["p"], days["p_holm"]], 2)
        assert_shows(f"{df} {medians}", [days["df"], days["p_days"]], 2)
        if days["day_share"] is None:
            assert share == "–"
        else:
            assert float(share) == pytest.approx(100 * days["day_share"], abs=0.5)


def test_differences_between_effects(study, json, folder: Path, page: ParsedPage) -> None:
    shown = page.table("Differences between effect sizes")[1:]
    for d, row, cells, terminal in zip(
        json["comparison"]["effect_differences"],
        rows_of(folder, "effect_differences"),
        shown,
        cells_below(comparison_blocks(study), "Which separates the conditions better"),
        strict=True,
    ):
        assert (row["first"], row["second"]) == (d["first"], d["second"])
        assert_same(row, d)
        assert_shows(cells[2], [d["estimate"], d["low"], d["high"]], 4)
        assert_shows(cells[3], [d["p"]], 2)
        assert_shows(cells[4], [d["p_holm"]], 2)
        _, estimate, ends, p, p_holm, _ = terminal
        values = [d["estimate"], d["low"], d["high"]] if ends else [d["estimate"]]
        for one, value in zip(numbers(f"{estimate} {ends}"), values, strict=True):
            assert one == pytest.approx(value, abs=0.000501)
        assert_shows(f"{p} {p_holm}", [d["p"], d["p_holm"]] if ends else [], 2)


def test_ratings(study, json, folder: Path, page: ParsedPage) -> None:
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
    lines = text_lines(comparison_blocks(study), 200)
    begin = next(k for k, line in enumerate(lines) if line.startswith("Examiners' ratings"))
    assert_shows(lines[begin + 2].rpartition("Kenward-Roger p")[2], [float(rows[2]["p"])], 2)
    for row in rows_of(folder, "rating_offsets"):
        assert float(row["offset"]) == found["offsets_by"][row["grouping"]][row["name"]]
    means = page.words("ratings").partition("intervals: ")[2]
    expected = []
    for name in ("OFF", "DBS"):
        expected += [found[key][name] for key in ("means", "means_low", "means_high")]
    assert_shows(means.partition(" Contrast")[0], expected, 3)


def test_sensitivity(study, json, folder: Path, page: ParsedPage) -> None:
    for s, row, cells, terminal in zip(
        json["comparison"]["sensitivity"],
        rows_of(folder, "sensitivity"),
        page.table("The shift by each method")[1:],
        cells_below(comparison_blocks(study), "By other methods"),
        strict=True,
    ):
        assert (row["measure"], row["method"], row["inertia"]) == (
            s["measure"],
            s["method"],
            s["inertia"],
        )
        assert_same(row, s)
        assert_shows(cells[5], [s["shift"], s["shift_low"], s["shift_high"]], 4)
        assert_shows(cells[7], [s["p"]], 2)
        assert_shows(cells[8], [s["p_day"]], 2)
        assert terminal[2:4] == (s["method"], s["inertia"])
        assert_shows(" ".join(terminal[4:]), [s["shift"], s["p"], s["p_day"]], 2)


def test_estimates_and_scores_of_every_epoch(study, json, folder: Path, page: ParsedPage) -> None:
    epochs, fixed = json["estimates"]["epochs"], json["estimates"]["fixed_inertia"]["epochs"]
    rows = rows_of(folder, "estimates")
    free = page.table("Inertia, damping and stiffness, epoch by epoch")
    held = page.table("Damping and stiffness with the inertia fixed")
    blocks = estimate_blocks(study)
    shown_free = cells_below(blocks, "J, B, K of each epoch")
    shown_held = cells_below(blocks, "B, K with the inertia held")
    for place, (one, two, row) in enumerate(zip(epochs, fixed, rows, strict=True)):
        assert (row["source"], row["epoch"]) == (one["source"], one["epoch"])
        assert_same(row, one)
        assert_same(row, two, "fixed_inertia_")
        for table, found in ((free, one), (held, two)):
            for name, symbol in zip(PARAMETERS, "JBK", strict=True):
                heading = next(
                    k for k, text in enumerate(table[0]) if text.startswith(f"{symbol} ")
                )
                ends = [found[name], found[f"{name}_low"], found[f"{name}_high"]]
                assert_shows(table[1 + place][heading], ends, 4)
        for terminal, found, names in (
            (shown_free[place], one, PARAMETERS),
            (shown_held[place], two, PARAMETERS[1:]),
        ):
            assert terminal[:2] == (found["epoch"], found["condition"])
            for name, cell in zip(names, terminal[2:], strict=False):
                factor = 1e3 if name == "inertia_kg_m2" else 1.0
                value, error = (factor * found[key] for key in (name, f"{name}_se"))
                assert_shows(cell, [value, error], 2)
                decimals = [len(shown.partition(".")[2]) for shown in cell.split(" ± ")]
                assert decimals[0] == decimals[1]
    for score, row in zip(json["estimates"]["scores"], rows_of(folder, "scores"), strict=True):
        assert_same(row, score)


def test_scores_of_every_epoch(study, json, folder: Path, page: ParsedPage) -> None:
    terminal = cells_below(estimate_blocks(study), "Scores of each")
    shown = page.table("Scores of the epochs")
    columns = [shown[0].index(next(h for h in shown[0] if h.startswith(name)))
               for name in ("Angular impulse", "Work", "Cycles", "Frequency")]  # fmt: skip
    for score, row, cells, line in zip(
        json["estimates"]["scores"], rows_of(folder, "scores"), shown[1:], terminal, strict=True
    ):
        assert (row["source"], row["epoch"]) == (score["source"], score["epoch"])
        assert line[:2] == (score["epoch"], score["condition"])
        values = [score[name] for name in ("impulse_nm_s", "work_j", "n_cycles", "frequency_hz")]
        for column, value in zip(columns, values, strict=True):
            assert_shows(cells[column], [value], 4)
        assert_shows(" ".join(line[2:]), values[:3], 5)


def test_pooled_estimates(study, json, folder: Path, page: ParsedPage) -> None:
    whole = json["estimates"]["pooled"]
    found = {**whole["conditions"], "all": whole}
    terminal = cells_below(estimate_blocks(study), "All epochs together")
    shown = page.table("All epochs of a condition together")
    rows = rows_of(folder, "pooled")
    assert [row["condition"] for row in rows] == ["OFF", "DBS", "(all)"]
    for place, ((name, fit), row) in enumerate(zip(found.items(), rows, strict=True)):
        assert_same(row, fit)
        assert terminal[3 * place][0] == name
        for k, parameter in enumerate(PARAMETERS):
            ends = [fit[parameter], fit[f"{parameter}_low"], fit[f"{parameter}_high"]]
            assert_shows(shown[1 + place][1 + k], ends, 4)
            assert_shows(" ".join(terminal[3 * place + k][2:4]), ends, 5)
