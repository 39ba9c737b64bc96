"""The findings of a recording are the same wherever they are shown."""

import csv
import json
import re
import shutil
from dataclasses import replace
from html import escape, unescape
from pathlib import Path

import numpy as np
import pytest
from tests.small_study import record

import rigidimeter as rm
from rigidimeter.analysis.estimation import estimate_recorded, prepare
from rigidimeter.core.files import plain_values
from rigidimeter.core.records import Channel

LEVELS = "note|caution|exclude"
PUSHING = {"OFF": {"voluntary_sd_nm": 0.2}}


@pytest.fixture
def shown(simulate, rigidimeter, no_figures, tmp_path):
    """Return what each output of a recording with findings holds."""

    def run(method):
        session = simulate(epochs=2, subject=PUSHING)
        files = tmp_path / "out.json", tmp_path / "out.csv"
        out = rigidimeter(
            "estimate", session, "--method", method, "--full", "--json", files[0], "--csv", files[1]
        ).out
        assert (
            rigidimeter("report", session, "--method", method, "--out", tmp_path / "r").status == 0
        )
        with files[1].open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        with (tmp_path / "r" / "tables" / "findings.csv").open(encoding="utf-8") as file:
            table = list(csv.DictReader(file))
        page = (tmp_path / "r" / "report.html").read_text("utf-8")
        return json.loads(files[0].read_text("utf-8")), rows, out, table, page

    return run


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
def test_every_output_has_every_finding(shown, method):
    document, rows, terminal, table, page = shown(method)
    found = [(e["epoch"], f) for e in document["epochs"] for f in e["findings"]]
    assert len(found) > 3
    in_json = {(epoch, f["level"], f["name"]) for epoch, f in found}
    in_csv = {
        (row["epoch"], *re.match(r"(\w+), (\w+): ", one).groups())
        for row in rows
        for one in row["findings"].split(" / ")
    }
    assert in_csv == in_json
    assert {
        (r["epoch"], r["level"], r["check"]) for r in table if r["epoch"] != "pooled"
    } == in_json
    pooled = {(f["level"], f["name"]) for f in document["pooled"]["findings"]}
    kinds = {(level, name) for _, level, name in in_json} | pooled
    assert set(re.findall(rf"^ ({LEVELS}) +(\w+)  ", terminal, re.M)) == kinds
    assert "The checks found nothing" not in page
    for _, name in kinds:
        assert f">{name}<" in page


def test_every_output_says_the_same_words(shown):
    """Terminal, page, tables, CSV, JSON and Python, for every finding of a recording."""
    document, rows, terminal, table, page = shown("bandlimited")
    estimates = rm.estimate(rm.read(document["epochs"][0]["source"]), method="bandlimited")
    of_python = [(fit.epoch, one) for fit in estimates.fits for one in fit.findings]
    in_json = [(e["epoch"], f) for e in document["epochs"] for f in e["findings"]]
    assert [(epoch, plain_values(one.row())) for epoch, one in of_python] == in_json
    in_table = {(r["epoch"], r["headline"], r["details"], r["remedy"]) for r in table}
    in_cells = {one for row in rows for one in row["findings"].split(" / ")}
    for epoch, one in of_python:
        assert (epoch, one.headline, one.details, one.words.remedy) in in_table
        assert f"{one.level}, {one.name}: {one.headline}" in in_cells
    on_terminal, on_page = " ".join(terminal.split()), " ".join(unescape(page).split())
    for group in estimates.findings:
        one = group.finding
        assert " ".join(group.line.split()) in on_terminal
        assert repr(group) == group.line
        unfolding = (
            f'<span class="outcome is-{one.level}">{one.level}</span> '
            f"<strong>{one.name}</strong> {one.headline}; {group.where}</summary> "
            f"<p>{one.details}</p> {f'<p>{one.words.remedy}</p>' * bool(one.remedy)}"
        )
        assert unfolding in on_page
        assert one.harmless or escape(one.headline) in estimates._repr_html_()
    assert any(group.finding.harmless for group in estimates.findings)


@pytest.fixture
def pushed(fitted_study, tmp_path):
    """Return a study whose subject pushed on one of the days in DBS."""
    folder = Path(shutil.copytree(fitted_study, tmp_path / "study"))
    shutil.rmtree(folder / "sessions/4-DBS")
    record(folder / "sessions/4-DBS", "DBS", 104, subject={"DBS": {"voluntary_sd_nm": 0.3}})
    return folder


def test_every_output_of_a_study_says_the_same(pushed, rigidimeter, no_figures, tmp_path):
    """Terminal, page, JSON, batch and Python: each finding, each reason, each statement, once."""
    how = ("--method", "published")
    ran = rigidimeter("compare", pushed, *how, "--resamples", 100)
    assert rigidimeter("report", pushed, *how, "--out", tmp_path / "r").status == 0
    assert rigidimeter("batch", pushed, *how, "--out", tmp_path / "b.csv").status == 0
    page = " ".join(unescape((tmp_path / "r" / "report.html").read_text("utf-8")).split())
    document = json.loads((pushed / "analysis/comparison.json").read_text("utf-8"))
    estimates = json.loads((pushed / "analysis/estimates.json").read_text("utf-8"))
    with (tmp_path / "b.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    result = rm.compare(pushed, method="published", resamples=0)
    terminal = " ".join(ran.out.split())

    said = result.statements
    assert document["statements"][0]["concluded"] == list(said.concluded)
    for sentence in (said.measured, said.tested, *said.concluded):
        assert terminal.count(sentence) == 1, ran
        assert sentence in page  # and in the sentence to quote, where nothing is shown
    of_epochs = [(fit.epoch, one) for fit in result.study.analysis.fits for one in fit.findings]
    assert [(e["epoch"], f) for e in estimates["epochs"] for f in e["findings"]] == [
        (epoch, plain_values(one.row())) for epoch, one in of_epochs
    ]
    cells = [one for row in rows for one in row["findings"].split(" / ") if one]
    assert sorted(cells) == sorted(f"{f.level}, {f.name}: {f.headline}" for _, f in of_epochs)
    across = [plain_values(one.row()) for one in result.study.analysis.across]
    assert estimates["across"] == across
    reasons = result.findings[len(result.study.analysis.findings) :]
    assert document["reasons"] == [
        plain_values(one.row()) | {"measures": where} for one, _, where in reasons
    ]
    assert (
        {one["finding"] for one in document["conclusion"]} - {""}
        == {group.finding.name for group in reasons}
        >= {"flagged_epochs"}
    )
    cautions = [g.finding for g in result.study.analysis.findings if g.finding.level != "note"]
    assert len(cautions) > 1
    for one, _, where in result.findings:
        assert page.count(f"<strong>{one.name}</strong> {one.headline}; {where}</summary>") == 1
        todo = f" <p>{one.words.remedy}</p>" * bool(one.remedy)
        assert page.count(f"<p>{one.details}</p>{todo}") == 1
        assert one.headline not in ran.err
    assert cautions[0].headline in terminal


def names_and_levels(recorded, method):
    fits = estimate_recorded(recorded, method).fits
    return [sorted((f.name, f.level) for f in fit.findings) for fit in fits]


def test_a_tenth_of_a_millisecond_of_jitter_changes_no_finding(simulate):
    recording = rm.read(simulate(subject={"OFF": {"voluntary_sd_nm": 0.35}}))
    rng = np.random.default_rng(1)
    moved = []
    for epoch in recording.epochs:
        channels = {}
        for name, c in epoch.channels.items():
            stamps = c.time_s + rng.uniform(-5e-5, 5e-5, len(c))
            channels[name] = Channel(name, stamps, c.values)
        moved.append(replace(epoch, channels=channels))
    one, two = (prepare(each, recording.settings) for each in (recording.epochs, moved))
    for method in ("auto", "bandlimited"):
        before = names_and_levels(one, method)
        assert before == names_and_levels(two, method)
        assert any(before)
