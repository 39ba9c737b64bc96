import csv
import json
import math
from dataclasses import asdict, replace
from pathlib import Path

import pytest
from numpy.testing import assert_equal

from rigidimeter.analysis.reading import read_estimates, write_estimates_csv, write_estimates_json
from rigidimeter.core.errors import UserError
from rigidimeter.core.findings import Effect, Finding
from rigidimeter.core.records import Analysis, BandEstimate, Delay, Fit, Outcome, Score

FOUND = Finding(
    "tremor",
    "caution",
    8.0,
    3.0,
    "%",
    epochs=("1", "2"),
    condition="OFF",
    effect=Effect((-4.0, -2.0, 0.0), (-1.5, -0.5, 0.0)),
    facts={"frequency_hz": 4.6, "amplitude_nm": 0.3, "stands_out": 12.0},
)
GOOD = Fit(
    "a.csv", "1", "OFF", "bandlimited", Outcome(),
    value=(0.0045, 0.13, 1.7), se=(1e-5, 1e-3, 0.02), low=(0.00448, 0.128, 1.66),
    high=(0.00452, 0.132, 1.74), bound=(9e-6, 9e-4, 0.019),
    r_squared=0.99, vaf_percent=99.1, condition_number=3.2, residual_sd_nm=0.004,
    n_samples=18000, band_hz=(0.15, 10.0), findings=(FOUND,),
    angle_rms_rad=0.04, angle_range_rad=0.2,
)  # fmt: skip
POOLED = replace(GOOD, epoch="pooled")
FAILED = Fit("a.csv", "2", "", "bandlimited", Outcome("failed", "torque_nm is constant"))
ANALYSIS = Analysis(
    "bandlimited",
    (GOOD, FAILED),
    (GOOD, FAILED),
    0.0045,
    (Score("a.csv", "3", "DBS", Outcome(), 0.4, 1 / 3, 8, 1.0),),
    (
        POOLED,
        replace(POOLED, condition="DBS"),
        replace(POOLED, condition="", value=(0.0046, 0.13, 1.7)),
    ),
    (Delay("a.csv", 0.007, 1e-5, corrected=True), Delay("b.csv", remark="not estimated")),
    "the perturbation was not recorded",
    (
        BandEstimate(
            "OFF", 0.1, 30.0, "all", (0.0045, 0.13, 1.7), (0.0,) * 3, (0.0,) * 3, (1.0,) * 3
        ),
        BandEstimate(
            "OFF",
            0.1,
            30.0,
            "first half",
            (0.0046, 0.13, 1.7),
            (1e-4, 0.0, 0.0),
            (1e-5, 1e-3, 0.02),
            (1e-9, 0.9, 1 / 3),
        ),
    ),
)


def test_what_stiffness_holds_of_the_weight_is_said(tmp_path):
    write_estimates_json(tmp_path / "e.json", ANALYSIS)
    said = json.loads((tmp_path / "e.json").read_text())["weight_in_stiffness"]
    assert said.startswith("includes the slope of the limb's weight unless the axis is vertical")
    upright = replace(ANALYSIS, axis="vertical")
    write_estimates_json(tmp_path / "e.json", upright)
    assert read_estimates(tmp_path / "e.json").axis == "vertical"
    assert upright.weight_in_stiffness == ""
    assert replace(ANALYSIS, fits=(), fixed_inertia=()).weight_in_stiffness == ""


def test_the_document_has_the_published_keys(tmp_path):
    write_estimates_json(tmp_path / "e.json", ANALYSIS)
    document = json.loads((tmp_path / "e.json").read_text())
    assert document["schema"] == "rigidimeter.estimates/2"
    assert document["method"] == "bandlimited"
    assert document["epochs"][0].keys() >= {
        "source", "epoch", "condition", "outcome", "reason", "inertia_kg_m2", "inertia_kg_m2_se",
        "damping_nm_s_rad", "damping_nm_s_rad_se", "stiffness_nm_rad", "stiffness_nm_rad_se",
        "inertia_kg_m2_low", "stiffness_nm_rad_high", "damping_nm_s_rad_bound",
        "r_squared", "vaf_percent", "condition_number", "n_samples", "findings",
    }  # fmt: skip
    assert document["epochs"][1]["inertia_kg_m2"] is None
    assert document["epochs"][1]["reason"] == "torque_nm is constant"
    assert document["fixed_inertia"]["inertia_kg_m2"] == 0.0045
    assert document["fixed_inertia"]["epochs"][0]["stiffness_nm_rad"] == 1.7
    assert document["scores"][0].keys() >= {"impulse_nm_s", "work_j"}
    # All epochs together under the keys of a fit, and each condition below.
    assert document["pooled"]["inertia_kg_m2"] == 0.0046
    assert document["pooled"]["conditions"]["DBS"]["inertia_kg_m2"] == 0.0045
    assert list(document["pooled"]["conditions"]) == ["OFF", "DBS"]
    assert document["delays"][0]["delay_s"] == 0.007
    assert document["delays"][1]["delay_s"] is None
    (finding,) = document["epochs"][0]["findings"]
    assert (finding["value"], finding["unit"], finding["limit"], finding["p"]) == (
        8.0,
        "%",
        3.0,
        None,
    )
    assert finding["effect"] == {
        "percent": [-4.0, -2.0, 0.0],
        "half_intervals": [-1.5, -0.5, 0.0],
    }
    assert finding["headline"] == "Torque oscillates at 4.6 Hz with 0.3 N·m"
    half = document["sensitivity"][1]
    assert (half["part"], half["high_hz"]) == ("first half", 30.0)
    assert half["inertia_kg_m2"] == 0.0046
    assert half["inertia_kg_m2_change"] == 1e-4
    assert half["damping_nm_s_rad_change_se"] == 1e-3
    assert half["stiffness_nm_rad_p"] == 1 / 3


def test_one_condition_is_pooled_once(tmp_path):
    only = replace(ANALYSIS, pooled=(POOLED,))
    write_estimates_json(tmp_path / "e.json", only)
    assert_equal(asdict(read_estimates(tmp_path / "e.json")), asdict(only))


def test_estimates_are_read_back_equal(tmp_path):
    write_estimates_json(tmp_path / "e.json", ANALYSIS)
    assert_equal(asdict(read_estimates(tmp_path / "e.json")), asdict(ANALYSIS))


def test_the_table_has_a_row_an_epoch_in_full_precision(tmp_path):
    write_estimates_csv(tmp_path / "e.csv", ANALYSIS)
    with (tmp_path / "e.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["outcome"] for row in rows] == ["included", "failed"]
    assert float(rows[0]["inertia_kg_m2"]) == 0.0045
    assert float(rows[0]["fixed_inertia_damping_nm_s_rad"]) == 0.13
    assert rows[1]["damping_nm_s_rad"] == ""


def test_scores_alone_give_the_table_of_scores(tmp_path):
    only = Analysis("bandlimited", (), (), math.nan, ANALYSIS.scores)
    write_estimates_csv(tmp_path / "s.csv", only)
    with (tmp_path / "s.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["work_j"]) == 1 / 3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "not valid JSON"),
        ("[]", "schema is None"),
        ('{"schema": "other/1"}', "schema is 'other/1'"),
        ('{"schema": "rigidimeter.estimates/2", "method": "x"}', "not a complete"),
        ("[" * 100_000, "nested more than 32 deep"),
    ],
)
def test_another_document_is_refused(tmp_path, text, words):
    (tmp_path / "e.json").write_text(text)
    with pytest.raises(UserError, match=words):
        read_estimates(tmp_path / "e.json")


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(UserError, match="cannot be written"):
        write_estimates_json(tmp_path / "no" / "e.json", ANALYSIS)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"inertia_kg_m2": 0.0045,', '"inertia_kg_m2": null,', "without all its numbers"),
        ('"outcome": "failed"', '"outcome": "foo"', "outcome 'foo'"),
        ('"n_samples": 18000', '"n_samples": 1e999', "pooled.n_samples is inf"),
    ],
)
def test_estimates_changed_by_hand_are_refused(tmp_path, old, new, words):
    path = tmp_path / "e.json"
    write_estimates_json(path, ANALYSIS)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(UserError, match=words):
        read_estimates(path)


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "e.json"
    path.write_text("the older one")

    def full(self, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(UserError, match="No space left"):
        write_estimates_json(path, ANALYSIS)
    assert path.read_text() == "the older one"
    assert list(tmp_path.iterdir()) == [path]


def test_what_could_not_be_read_back_is_not_written(tmp_path, monkeypatch):
    monkeypatch.setattr("rigidimeter.analysis.reading.estimate_files.ESTIMATES_BYTES", 2000)
    with pytest.raises(UserError, match=r"2 epochs take .* KiB as JSON, and at most 1\.95 KiB"):
        write_estimates_json(tmp_path / "e.json", ANALYSIS)
    assert not (tmp_path / "e.json").exists()
