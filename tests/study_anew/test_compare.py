"""`compare` of both rooms, of whatever holds conditions: the same is said, kept, and refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from tests.study_anew.both import RESAMPLES, Answers, apart, new_answers, of_anything, old_answers
from tests.study_anew.designs import random_study

import rigidimeter as rm
from rigidimeter.analysis import study as old
from rigidimeter.analysis import study_anew as new
from rigidimeter.analysis.reading import estimates_document
from rigidimeter.core.files import write_json
from rigidimeter.core.records import Analysis

TABLE = pd.DataFrame({"state": ["OFF", "ON", "half"] * 4, "k": [1.8, 1.4, 1.7] * 4})


def same(x: Any, **options: Any) -> Answers | str:
    before, now = of_anything(x, **options)
    assert not [str(one) for one in apart(before, now)]
    return now


@pytest.fixture(scope="module")
def estimates() -> Analysis:
    return random_study(36).analysis


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"other": "DBS"},
        {"reference": "LOW"},
        {"reference": "DBS", "other": "OFF"},
        {"other": "gone"},
        {"reference": "OFF", "other": "OFF"},
        {"group": "patients"},
    ],
)
def test_of_estimates(estimates: Analysis, options: dict[str, str]) -> None:
    same(estimates, resamples=RESAMPLES, **options)


def test_of_estimates_in_a_file(estimates: Analysis, tmp_path: Path) -> None:
    write_json(tmp_path / "estimates.json", estimates_document(estimates))
    assert len(same(str(tmp_path / "estimates.json"), resamples=RESAMPLES).conclusion) > 2


def test_of_estimates_in_one_condition(estimates: Analysis) -> None:
    own = {
        name: tuple(one for one in getattr(estimates, name) if one.condition == "OFF")
        for name in ("fits", "fixed_inertia", "scores", "pooled")
    }
    alone = replace(estimates, **own)
    assert "a comparison needs two conditions" in same(alone)
    result = old.compare_analysis(alone, resamples=0)
    found = new.conclude_study(new.analysis_study(alone), resamples=0)
    assert not list(apart(old_answers(result), new_answers(found)))
    assert found.comparisons == ()


@pytest.mark.parametrize("seed", [3, 4, 36])
def test_of_epochs_whose_order_in_time_is_known(seed: int) -> None:
    made = random_study(seed, known_days=False)
    result = replace(old.compare_analysis(made.analysis, resamples=0), epochs=made.epochs)
    found = new.conclude_study(new.analysis_study(made.analysis, epochs=made.epochs), resamples=0)
    assert not [str(one) for one in apart(old_answers(result), new_answers(found))]


def test_of_a_recording() -> None:
    recording = rm.data("elbow")
    analysis = rm.estimate(recording)
    result = old.recording_result(recording, analysis)
    study = new.analysis_study(analysis, epochs=recording.epochs, settings=recording.settings)
    found = replace(new.conclude_study(study, resamples=0), notices=recording.notices)
    before = old_answers(result)._replace(documents=[old.comparison_document(result)])
    now = new_answers(found)._replace(documents=[new.comparison_document(found)])
    assert not [str(one) for one in apart(before, now)]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "a table needs value="),
        ({"value": []}, "a table needs value="),
        ({"value": "gone", "by": "state"}, "there is no column gone"),
        ({"value": "k", "by": "gone"}, "there is no column gone"),
        ({"value": "k", "by": "state", "session": "gone"}, "there is no column gone"),
        ({"value": "k", "by": "state", "group": "old"}, "there is no column group"),
        ({"value": "state", "by": "state"}, "is not a number"),
        ({"value": "k", "by": "state", "other": "gone"}, "there is no such condition"),
    ],
)
def test_a_table_that_is_refused(options: dict[str, Any], message: str, tmp_path: Path) -> None:
    assert message in same(TABLE, **options)
    TABLE.to_csv(tmp_path / "table.csv", index=False)
    if options:
        same(tmp_path / "table.csv", **options)


def test_of_a_table_and_its_file(tmp_path: Path) -> None:
    table = TABLE.assign(subject=[1, 1, 1, 2, 2, 2] * 2, k=TABLE["k"] + 0.01 * TABLE.index)
    table.to_csv(tmp_path / "table.csv", index=False)
    for x in (table, str(tmp_path / "table.csv")):
        assert len(same(x, value=["k"], by="state", resamples=RESAMPLES).conclusion) == 2


def test_what_is_neither(tmp_path: Path) -> None:
    assert "not something of type int" in same(3)
    assert "is neither a study folder nor a JSON file" in same(tmp_path)
    (tmp_path / "elbow.csv").write_text("time_s,torque_nm\n")
    assert "for a recording give what estimate returns" in same(tmp_path / "elbow.csv")
    assert "cannot be read" in same(tmp_path / "gone.json")
    twice = pd.DataFrame([[1.0, "OFF", "a"], [2.0, "ON", "b"]], columns=["k", "state", "state"])
    assert "two columns with the name state" in same(twice, value="k", by="state")


def test_progress_is_one_in_all(estimates: Analysis) -> None:
    shares: list[float] = []
    new.compare(estimates, resamples=RESAMPLES, progress=shares.append)
    assert sum(shares) == pytest.approx(1.0)
