"""The report as a whole, from good studies and from poor ones."""

import base64
import csv
import dataclasses
import hashlib
import math
import re
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from tests.unit.analysis.report.parsed_page import ParsedPage

from rigidimeter.analysis.recording import estimate
from rigidimeter.analysis.report import Shown, page_text, report, sections_of
from rigidimeter.core.findings import Finding, Level
from rigidimeter.core.records import Epoch, Notice, Outcome
from rigidimeter.core.words import Table, interval, with_error

NASTY = "<script>alert('x')</script>&amp;\"$_$"


def page_of(study: Shown, out: Path) -> ParsedPage:
    return ParsedPage(report(study, out).read_text(encoding="utf-8"))


def words_of(study: Shown) -> str:
    """Return the words of the page, whose figures are not drawn."""
    return " ".join(ParsedPage(page_text(study)).text.split())


@pytest.fixture(scope="module")
def written(study: Shown, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return report(study, tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module")
def page(written: Path) -> ParsedPage:
    return ParsedPage(written.read_text(encoding="utf-8"))


def test_page_needs_nothing_beside_it(written: Path, page: ParsedPage) -> None:
    assert written.name == "report.html"
    assert not {"link", "iframe", "object", "base", "img"} & set(page.tags)
    assert page.of("src") == []
    names = page.of("id")
    assert len(names) == len(set(names))
    anchors = {f"#{name}" for name in names}
    for link in (*page.of("href"), *page.of("xlink:href")):
        assert link in anchors or (written.parent / link).is_file(), link
    linked = {written.parent / link for link in page.of("href")}
    assert {*(written.parent / "figures").iterdir()} <= linked
    assert not re.search(r"url\([^#]|@import|https?:", written.read_text(encoding="utf-8"))


def test_the_page_runs_its_own_script_alone(written: Path) -> None:
    text = written.read_text(encoding="utf-8")
    (script,) = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{digest}'" in text
    assert "Copyright (c) 2022 Leon Sorokin" in script
    assert "without restriction" in script


def test_every_table_is_written_with_all_of_its_values(written: Path, study: Shown) -> None:
    blocks = (block for _, blocks in sections_of(study) for block in blocks)
    made = {block.name: block for block in blocks if isinstance(block, Table)}
    names = {path.stem for path in (written.parent / "tables").iterdir()}
    assert names == {*made, "data-dictionary"}
    del made["provenance"]  # the report adds what it is of
    for name, table in made.items():
        path = written.parent / "tables" / f"{name}.csv"
        with path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(file)
            rows = list(reader)
        assert len(rows) == len(table.rows)
        assert {column.name for column in table.columns} <= set(reader.fieldnames or ())
        for row, expected in zip(rows, table.rows, strict=True):
            for key, value in expected.items():
                if isinstance(value, float) and not math.isnan(value):
                    assert float(row[key]) == value
                elif value is not None and not isinstance(value, float):
                    assert row[key] == str(value)
                else:
                    assert row[key] == ""


def test_every_figure_of_the_page_lies_beside_it(written: Path, page: ParsedPage) -> None:
    stored = [path.read_bytes() for path in (written.parent / "figures").glob("*.svg")]
    assert page.tags.count("figcaption") == len(stored)
    names = {path.stem for path in (written.parent / "figures").glob("*.svg")}
    assert names == {
        "distribution_inertia_kg_m2",
        "distribution_damping_nm_s_rad",
        "distribution_stiffness_nm_rad",
        "distribution_impulse_nm_s",
        "distribution_work_j",
        "perturbation",
        "voluntary_spectrum",
        "band_sensitivity",
        "torque_1_off",
        "torque_2_dbs",
        "recorded",
        "loops",
    }
    for svg in stored:
        texts = [one.text for one in ET.fromstring(svg).iter() if one.tag.endswith("}text")]
        assert texts
        assert not any(re.search(r"\$|mathdefault|\\", text or "") for text in texts)
        assert all(any(text in part for part in page.parts) for text in texts if text)


def test_page_is_accessible(page: ParsedPage) -> None:
    assert page.of("lang") == ["en"]
    drawings = [a for a in page.elements if a.get("role") == "img"]
    assert page.tags.count("svg") == len(drawings) == sum(bool(a["aria-label"]) for a in drawings)
    assert page.tags.count("caption") == page.tags.count("table") > 5
    assert page.tags.count("h1") == 1


def test_page_says_what_was_done(page: ParsedPage, study: Shown) -> None:
    text = " ".join(page.text.split())
    assert "the arm touched the position limit" in text
    assert "one column was empty" in text
    assert "Two-sided Wilcoxon rank-sum test, asymptotic" in text
    assert "tie and continuity correction" in text
    assert "Main settings" in text
    assert "0.0458366" not in text  # of a rig that these recordings never saw
    assert "virtual subject" not in text.lower()


def test_virtual_epochs_are_declared(study: Shown, make_study) -> None:
    one = dataclasses.replace(study.epochs[1], virtual=True)
    mixed = make_study([one, study.epochs[2]])
    text = words_of(mixed)
    assert "Virtual subject: no measurement of a person or animal." in text
    assert "1 of 2 epochs were made by a simulation" in text


def test_special_characters_are_escaped(study: Shown, make_study, tmp_path: Path) -> None:
    """Also what is no text: a byte of a file's name that is not UTF-8."""
    odd = f"{NASTY}caf\udce9"
    epochs = [
        dataclasses.replace(epoch, source=f"/{NASTY}/{odd}", condition=odd, label=NASTY)
        for epoch in (study.epochs[1], study.epochs[-1])
    ]
    epochs.append(dataclasses.replace(epochs[0], label="b", closed=Outcome("excluded", NASTY)))
    nasty = make_study(
        epochs,
        title=NASTY,
        notices=(Notice("error", NASTY),),
        provenance={NASTY: NASTY},
    )
    page = page_of(nasty, tmp_path)
    assert page.tags.count("script") == 2  # its own
    assert page.text.count(NASTY) > 8
    assert f"{NASTY}caf\\udce9" in page.text
    assert any(NASTY in alt for alt in page.of("aria-label"))
    for path in (tmp_path / "figures").glob("*.svg"):
        ET.fromstring(path.read_bytes())


def test_page_tells_what_the_estimates_know(page: ParsedPage, study: Shown) -> None:
    text = " ".join(page.text.split())
    analysis = study.analysis
    assert "Method: iv (instrumental variables" in text
    assert f"Chosen automatically: {analysis.method_reason}." in text
    for delay in analysis.delays:
        assert with_error(1e3 * delay.delay_s, 1e3 * delay.delay_s_se) in text
    for fit in (*analysis.fits, *analysis.fixed_inertia, *analysis.pooled):
        assert interval(fit.stiffness_nm_rad_low, fit.stiffness_nm_rad_high) in text
    assert "(all)" in text
    assert "with fewer, each is the wider of that and what the residual gives" in text
    assert "Intervals are made from the power of the residual at each frequency" in text
    assert "Torque over angle" not in text  # needs a perturbation that repeats


def test_a_method_asked_for_by_name_says_so(study: Shown, make_study) -> None:
    epochs = [study.epochs[1]]
    made = make_study(epochs, analysis=estimate(epochs, "published", settings=study.study.settings))
    text = words_of(made)
    assert (
        "Method: published (least squares as the paper prints it). It was requested by name."
        in text
    )
    assert "The delay between torque and motion was not estimated." in text
    assert "Intervals take the residual for white" in text
    assert "The joint is taken for one that does not change" in text


@pytest.mark.usefixtures("no_figures")
def test_the_joint_over_frequency_is_on_the_page(periodic_study: Shown, tmp_path: Path) -> None:
    text = " ".join(page_of(periodic_study, tmp_path).text.split())
    assert "Torque over angle at the frequencies of the perturbation" in text
    assert (tmp_path / "figures" / "impedance.svg").exists()


def found(level: Level, name: str = "voluntary_torque", value: float = 20.0) -> Finding:
    facts = {"sd_nm": 0.2, "low_hz": 0.3, "high_hz": 4.0, "channel": "torque_nm", "start_s": 3.0}
    return Finding(name, level, value, 15.0, facts=facts)


@pytest.mark.usefixtures("no_figures")
def test_findings_are_told_once_a_kind(make_study, make_analysis, tmp_path: Path) -> None:
    analysis = make_analysis({"OFF": 30, "DBS": 2}, scores=False)
    fits = [
        dataclasses.replace(fit, findings=(found("caution", value=20.0 + int(fit.epoch)),))
        for fit in analysis.fits[:-1]
    ]
    last = dataclasses.replace(analysis.fits[-1], findings=(found("exclude", "frozen"),))
    together = tuple(
        dataclasses.replace(fit, epoch="pooled", findings=(found("note", "varying"),))
        for fit in fits[:2]
    )
    analysis = dataclasses.replace(analysis, fits=(*fits, last), pooled=together)
    made = make_study([], analysis=analysis)
    text = " ".join(page_of(made, tmp_path).text.split())
    lines = [
        "exclude frozen torque_nm repeats one value for 20 s; epoch 1",
        "caution voluntary_torque 49 % of the torque variance is not explained by J, B and K; ",
        "note varying varying: 20, limit 15; all epochs together",
    ]
    places = [text.index(line) for line in lines]
    assert places == sorted(places)
    with (tmp_path / "tables" / "findings.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 34
    assert rows[1]["headline"] == "21 % of the torque variance is not explained by J, B and K"


@pytest.mark.usefixtures("no_figures")
def test_one_condition_is_summarised(study: Shown, make_study, tmp_path: Path) -> None:
    page = page_of(make_study([e for e in study.epochs if e.condition == "DBS"]), tmp_path)
    assert "No two conditions were compared." in page.text
    assert "Medians and quartiles by condition" in page.text
    assert (tmp_path / "figures" / "torque_1_dbs.svg").exists()


@pytest.mark.usefixtures("no_figures")
def test_a_foreign_recording_of_torque_and_angle(study, make_study, tmp_path: Path) -> None:
    epoch = study.epochs[1]
    channels = {name: epoch.channels[name] for name in ("torque_nm", "angle_rad")}
    foreign = Epoch("C:\\data\\wrist.csv", "1", channels)
    page = page_of(make_study([foreign], provenance={}), tmp_path)
    assert "Record the perturbation (perturbation_nm)" in page.text
    assert not {"perturbation", "loops", "scores"} & set(page.of("id"))
    assert "(no condition)" in page.text
    assert (tmp_path / "figures" / "torque_1_unnamed.svg").exists()


@pytest.mark.parametrize(
    ("counts", "outcome"),
    [
        ({}, None),
        ({"OFF": 4, "DBS": 4}, Outcome("failed", "torque_nm was not recorded")),
        ({"OFF": 4, "DBS": 4}, Outcome("excluded", "R² is −3, below zero")),
        ({"OFF": 1}, None),
        ({"OFF": 1, "DBS": 2}, None),
        ({"OFF": 3, "DBS": 3}, None),
        ({"OFF": 60, "DBS": 40}, None),
        ({"OFF": 5, "DBS": 5, "levodopa": 4}, None),
    ],
)
@pytest.mark.parametrize("scores", [True, False])
def test_degenerate_studies(
    counts, outcome, scores: bool, make_study, make_analysis, tmp_path: Path
) -> None:
    analysis = make_analysis(counts, outcome, scores and outcome is None)
    made = make_study([], analysis=analysis)
    # Without scores the page has a part of the same figures.
    text = page_of(made, tmp_path).text if scores else words_of(made)
    assert "nan" not in text.split()
    for fit in analysis.fits:
        assert fit.outcome.reason in text


def test_short_samples_say_what_their_interval_is(make_study, make_analysis) -> None:
    made = make_study([], analysis=make_analysis({"OFF": 3, "DBS": 3}))
    assert any(one.tested for one in made.result.values)
    text = words_of(made)
    assert "too few values for an interval at this confidence" in text


def test_epochs_without_samples(make_study, make_analysis, tmp_path: Path) -> None:
    empty = Epoch("a.csv", "1", {}, closed=Outcome("failed", "the file ends in its header"))
    page = page_of(make_study([empty], analysis=make_analysis({})), tmp_path)
    assert "the file ends in its header" in page.text


def test_a_recording_without_a_condition_is_not_compared_with_itself(
    make_study, make_analysis
) -> None:
    made = make_study([], analysis=make_analysis({"": 4}))
    assert not made.result.comparisons
    assert "(no condition) against" not in words_of(made)
