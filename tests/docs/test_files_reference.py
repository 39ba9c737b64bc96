"""The reference of files names the columns, keys and sentences that the program writes."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from jsonschema import Draft202012Validator
from tests.docs.files_tables import analysis
from tests.docs.generated import FOLDER
from tests.docs.markdown import ROOT, table
from tests.known_joint import angle_rad, torque_nm
from typer.testing import CliRunner

from rigidimeter.analysis.batch import columns as batch_columns
from rigidimeter.analysis.reading import ReadOptions, estimates_document, read_recording
from rigidimeter.cli.main import app
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Activity
from rigidimeter.core.session import SessionWriter, read_events, read_manifest, read_session_files
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import STUDY_SCHEMA

FILES = ROOT / "docs" / "reference" / "files.md"
HOW_TO = ROOT / "docs" / "how-to"
RUN = CliRunner()


def test_the_sample_columns_are_those_of_the_log(simulate: Callable[[], Path]) -> None:
    recorded = read_session_files(simulate())
    assert list(table(FILES, "samples.arrows")) == list(recorded.samples.columns)
    assert table(FILES, "samples.arrows") == recorded.manifest["channel_units"]


def test_the_manifest_and_event_keys_are_those_of_a_session(tmp_path: Path) -> None:
    writer = SessionWriter(tmp_path / "s", Settings(), [], {"session": 1}, virtual=True)
    writer.event("session_started", time_s=0.0)
    named = {"label": "1", "task": "prbs", "condition": "OFF"}
    writer.event("epoch_started", epoch=1, **named, time_s=0.0, planned_s=20.0, true_joint={})
    ending = {"time_s": 20.0, "outcome": "success", "reason": "", "limited_ticks": 0}
    writer.event("epoch_ended", epoch=1, **ending)
    writer.event("return_started", time_s=20.1, from_rad=0.1, duration_s=3.0)
    writer.close(20.0, "success", "")
    assert list(table(FILES, "manifest.json")) == list(read_manifest(tmp_path / "s"))
    events, _ = read_events(tmp_path / "s" / "events.jsonl")
    documented = table(FILES, "events.jsonl")
    assert list(documented) == [event["event"] for event in events]
    for event in events:
        keys = re.findall(r"`([a-z_]+)`", documented[event["event"]])
        assert keys == [key for key in event if key != "event"]


def test_the_keys_of_the_estimates_are_documented() -> None:
    document = estimates_document(analysis())
    assert list(table(FILES, "Top level")) == list(document)
    of_emg = set(Activity((), 0.0, 0.0).row())
    assert set(table(FILES, "Each fit")) - of_emg == set(document["epochs"][0])
    assert set(table(FILES, "Each fit")) - of_emg == set(document["fixed_inertia"]["epochs"][0])
    assert set(table(FILES, "Each score")) == set(document["scores"][0])
    assert set(table(FILES, "Each finding")) == set(document["epochs"][0]["findings"][0])
    assert set(table(FILES, "Each delay")) == set(document["delays"][0])
    assert set(document["pooled"]) == {*table(FILES, "Each fit"), "conditions"} - of_emg
    assert set(document["fixed_inertia"]) == {"inertia_kg_m2", "epochs"}
    assert f"`{document['schema']}`" in FILES.read_text("utf-8")


def test_the_columns_of_a_batch_are_documented() -> None:
    named, columns = list(table(FILES, "Batch table")), list(batch_columns())
    assert named == columns[:10] + columns[-4:]
    emg = Activity((), 0.0, 0.0).row()
    of_each = {*analysis().rows()[0], *analysis().scores[0].row(), *emg}
    assert set(columns[10:-4]) == of_each - set(columns[:10])
    assert all(f"`{name}`" in FILES.read_text("utf-8") for name in emg)


def test_the_keys_of_the_comparisons_are_documented(tmp_path: Path) -> None:
    estimates, out = tmp_path / "estimates.json", tmp_path / "comparisons.json"
    estimates.write_text(json.dumps(estimates_document(analysis())), "utf-8")
    result = RUN.invoke(app, ["compare", str(estimates), "--json", str(out)])
    assert result.exit_code == 0, result.output
    document: dict[str, Any] = json.loads(out.read_text("utf-8"))
    assert list(table(FILES, "Top level of a comparison")) == list(document)
    documented = table(FILES, "Each comparison")
    tested = [row for row in document["comparisons"] if not row["remark"]]
    assert tested
    for row in document["comparisons"]:
        assert list(row) == list(documented)
    for row in document["conclusion"]:
        keys = [key for key in table(FILES, "Each conclusion") if not key.startswith("simulated_")]
        assert list(row) == keys
    groups = set(re.findall(r"`([a-z0-9_]+)`", documented["groups"]))
    assert groups == set(tested[0]["groups"]["OFF"])
    assert f"`{document['schema']}`" in FILES.read_text("utf-8")


def test_the_keys_of_a_study_are_documented(study: Path) -> None:
    result = RUN.invoke(app, ["compare", str(study), "--resamples", "100"])
    assert result.exit_code == 0, result.output
    document: dict[str, Any] = json.loads((study / "analysis/comparison.json").read_text("utf-8"))
    assert list(table(FILES, "Top level of a comparison")) == list(document)
    assert list(table(FILES, "Each test by days")) == list(document["comparisons"][0]["days"])
    _assert_valid(document, "comparison.json")
    kept = {path.name for path in (study / "analysis").iterdir()}
    section = FILES.read_text("utf-8").split("## Study folder")[1].split("### Top level")[0]
    assert kept <= set(re.findall(r"`([a-z_-]+\.(?:json|csv|parquet))`", section))
    inputs = json.loads((study / "analysis/inputs.json").read_text("utf-8"))
    for schema in (document["schema"], inputs["schema"], STUDY_SCHEMA):
        assert f"`{schema}`" in FILES.read_text("utf-8")


def test_the_estimates_of_a_session_are_as_documented(
    simulate: Callable[[], Path], tmp_path: Path
) -> None:
    out = tmp_path / "estimates.json"
    result = RUN.invoke(app, ["estimate", str(simulate()), "--json", str(out)])
    assert result.exit_code == 0, result.output
    document = json.loads(out.read_text("utf-8"))
    assert list(table(FILES, "Top level")) == list(document)
    of_emg = set(Activity((), 0.0, 0.0).row())
    assert set(table(FILES, "Each fit")) - of_emg == set(document["epochs"][0])
    _assert_valid(document, "estimates.json")


def _assert_valid(document: dict[str, Any], name: str) -> None:
    schema = json.loads((FOLDER / name).read_text("utf-8"))
    assert [error.message for error in Draft202012Validator(schema).iter_errors(document)] == []
    assert _unknown(document, schema) == set()


def _unknown(value: Any, schema: dict[str, Any]) -> set[str]:
    """Return the keys of a document that its schema does not have."""
    if isinstance(value, list):
        return {key for one in value for key in _unknown(one, schema.get("items", {}))}
    if not isinstance(value, dict) or "properties" not in schema:
        return set()
    known = schema["properties"]
    below = {key for name in value.keys() & known for key in _unknown(value[name], known[name])}
    return below | (value.keys() - known)


def _elbow(tmp_path: Path) -> dict[str, str]:
    """Write the recordings that the page quotes sentences about; return name to sentence."""
    time_s = np.arange(4000) * 0.005
    rows = [[f"{t:.3f}", f"{np.sin(t):.6f}", f"{0.2 * np.cos(3 * t):.6f}"] for t in time_s.tolist()]

    def write(name: str, changed: list[list[str]]) -> None:
        lines = ["time_s,torque_nm,angle_rad", *(",".join(row) for row in changed)]
        (tmp_path / name).write_text("\n".join(lines) + "\n", "utf-8")

    def without_torque(start: int, stop: int, mark: str) -> list[list[str]]:
        return [[t, mark if start <= k < stop else m, a] for k, (t, m, a) in enumerate(rows)]

    write("nan.csv", without_torque(1000, 1003, "NaN"))
    write("hole.csv", without_torque(1000, 1300, ""))
    write("gap.csv", [*rows[:2000], *rows[2400:]])
    write("text.csv", without_torque(700, 701, "overload"))
    write("back.csv", [*rows[:500], [rows[498][0], *rows[500][1:]], *rows[501:]])
    torque = torque_nm(time_s)
    angle = angle_rad(time_s)
    joint = [f"{t:.3f},{m:.6f},{a:.6f}" for t, m, a in zip(time_s, torque, 2 * angle, strict=True)]
    text = "\n".join(["time_s,torque_nm,angle", *joint])
    (tmp_path / "nounits.csv").write_text(text, "utf-8")
    names = ("nan.csv", "hole.csv", "gap.csv", "text.csv", "back.csv", "nounits.csv")
    said = {}
    for name in names:
        try:
            notices = read_recording(tmp_path / name, ReadOptions())[1]
            said[name] = f"{notices[0].level}: {notices[0].text}"
        except UserError as refusal:
            said[name] = f"rigidimeter: {refusal}"
    return {name: text.replace(f"{tmp_path}/", "") for name, text in said.items()}


def test_the_sentences_about_recordings_are_those_that_are_printed(tmp_path: Path) -> None:
    pages = ("gaps-and-time.md", "units-and-signs.md")
    page = "\n".join((HOW_TO / name).read_text("utf-8") for name in pages).splitlines()
    for name, sentence in _elbow(tmp_path).items():
        assert set(sentence.splitlines()) <= set(page), name
