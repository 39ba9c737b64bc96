"""The first screen of `estimate` has the numbers of its document."""

import math
from collections.abc import Sequence
from dataclasses import replace
from statistics import fmean, stdev
from typing import Any

import pytest
from tests.unit.analysis.report.cohorts import Design, made_study
from tests.unit.analysis.report.conftest import fit
from tests.unit.analysis.report.parsed_page import assert_shows, numbers

from rigidimeter.analysis.reading import Recording, estimates_document
from rigidimeter.analysis.recording import condition_precisions
from rigidimeter.analysis.report import Shown
from rigidimeter.cli.estimate_text import estimate_blocks
from rigidimeter.cli.terminal_tables import Table
from rigidimeter.core.records import Analysis, Outcome, Score
from rigidimeter.core.settings import Settings

PARAMETERS = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")


@pytest.fixture(scope="module")
def shown() -> Shown:
    return made_study(Design(days=(2, 2), epochs=(4, 4), scores=(1, 1)))


@pytest.fixture(scope="module")
def analysis(shown: Shown) -> Analysis:
    """Return estimates with those of all epochs of each condition together."""
    found = shown.analysis
    first = next(one for one in found.fits if one.outcome.included)
    pooled = tuple(
        replace(first, source="pooled", epoch="pooled", condition=name, value=share * first.value)
        for name, share in (("OFF", 1.01), ("DBS", 0.87), ("", 0.93))
    )
    return replace(found, pooled=pooled)


def first_screen(analysis: Analysis, column: str, *recorded: Any) -> list[Sequence[str]]:
    """Return the rows of the table of the first screen of `estimate` with this first heading."""
    read = Recording(recorded, (), Settings(), ())
    blocks = [one for one in estimate_blocks(read, analysis) if isinstance(one, Table)]
    table = next(one for one in blocks if one.headings and one.headings[0] == column)
    return [row for row in table.rows if not isinstance(row, str)]


def test_the_first_screen_of_estimates_has_the_numbers_of_the_document(
    shown: Shown, analysis: Analysis
) -> None:
    """Value ± standard error to two digits of the error: the first four epochs, and the last."""
    epochs = estimates_document(analysis)["epochs"]
    assert len(epochs) > 8
    fits = tuple(replace(fit, source="x.csv") for fit in analysis.fits)
    one_file = replace(analysis, fits=fits, fixed_inertia=fits, scores=())
    rows = first_screen(one_file, "epoch", *shown.epochs)[:6]
    of_several = first_screen(analysis, "epoch", *shown.epochs)
    assert of_several[0][0] == "together"
    assert rows[4][0] == "…"
    for row, one in zip([*rows[:4], rows[5]], [*epochs[:4], epochs[-1]], strict=True):
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


def test_the_first_screen_has_all_epochs_together(shown: Shown, analysis: Analysis) -> None:
    """Value, 95 % interval and SD between epochs of each condition."""
    document = estimates_document(analysis)
    pooled = document["pooled"]["conditions"]
    rows = first_screen(analysis, "epoch", *shown.epochs)
    for name in ("OFF", "DBS"):
        begin = next(k for k, row in enumerate(rows) if row[:2] == ("together", name))
        value, ends, sd = rows[begin : begin + 3]
        assert (ends[0], sd[0]) == ("95 %", "SD")
        own = [
            one
            for one in document["epochs"]
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


def of_one_condition(epochs: int) -> Analysis:
    fits = tuple(fit(f"{k}", "DBS", 0.1 + 0.02 * k) for k in range(epochs))
    scores = tuple(
        Score("x.csv", f"s{k}", "DBS", Outcome(), 1.0 + 0.1 * k, 0.3 + 0.05 * k, 8, 1.0)
        for k in range(epochs)
    )
    return Analysis("bandlimited", fits, fits, 0.0045, scores)


def test_the_first_screen_has_the_precision_of_one_condition() -> None:
    """Without a fit to all epochs together: means over epochs, of one epoch without an interval."""
    analysis = of_one_condition(3)
    found = condition_precisions(Recording((), (), Settings(), ()), analysis)["DBS"]
    value, ends, sd = first_screen(analysis, "epoch")[-3:]
    for k, name in enumerate(PARAMETERS, start=2):
        one = found[name]
        factor = 1e3 if name == "inertia_kg_m2" else 1.0
        shown = numbers(f"{value[k]} {ends[k]}")
        places = len(value[k].partition(".")[2])
        for number, size in zip(shown, (one.value, one.low, one.high), strict=True):
            assert abs(number - factor * size) <= 0.501 * 10.0**-places
        assert_shows(sd[k], [one.sd_percent], 2)
    (scores,) = first_screen(analysis, "sinusoids")
    assert scores[1] == "3"
    for cell, name in zip(scores[2:], ("impulse_nm_s", "work_j"), strict=True):
        assert_shows(cell, [found[name].value, found[name].sd_percent], 2)
    (scores,) = first_screen(of_one_condition(1), "sinusoids")
    assert "SD" not in " ".join(scores)
