"""BIDS: the validator's verdict, the kinds of channels, and the numbers."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigidimeter.analysis.export import export_sessions, sessions_of_study
from rigidimeter.analysis.study import load_study

VALIDATOR = Path(sys.executable).with_name("bids-validator-deno")


def errors(folder: Path) -> list[str]:
    """Return what the BIDS validator calls an error."""
    if not VALIDATOR.exists():
        pytest.skip("needs bids-validator-deno")
    command = [str(VALIDATOR), str(folder), "--json"]
    ran = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    found = json.loads(ran.stdout)
    assert "motion" in found["summary"]["dataTypes"]
    return [
        f"{issue['code']} {issue.get('location', '')} {issue.get('issueMessage', '')}"
        for issue in found["issues"]["issues"]
        if issue["severity"] == "error"
    ]


def rows(path: Path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file, delimiter="\t"))


def test_a_session(exported, tmp_path: Path) -> None:
    out = tmp_path / "bids"
    export_sessions([exported], "bids", out)
    assert errors(out) == []
    motion = out / "sub-S1" / "ses-day1" / "motion"
    head = "sub-S1_ses-day1_task-rigidity"
    for stream in exported.streams:
        stem = f"{head}_tracksys-{stream.name}_acq-OFF"
        values = np.genfromtxt(motion / f"{stem}_motion.tsv", missing_values="n/a", delimiter="\t")
        expected = [stream.time_s, *stream.columns.values()]
        np.testing.assert_array_equal(values, np.column_stack(expected))
        names = [row["name"] for row in rows(motion / f"{stem}_channels.tsv")]
        assert names == ["time_s", *stream.columns]
    channels = rows(motion / f"{head}_tracksys-motion_acq-OFF_channels.tsv")
    assert [row["type"] for row in channels] == ["LATENCY", "JNTANG", "VEL", "MISC", "MISC"]
    assert [row["units"] for row in channels][:3] == ["s", "rad", "rad/s"]
    described = json.loads((out / "dataset_description.json").read_text())
    assert "simulated" in described["Name"]
    place = out / "derivatives" / "rigidimeter" / "sub-S1" / "ses-day1" / "motion"
    fits = rows(place / f"{head}_acq-OFF_estimates.tsv")
    expected_fits = exported.about["estimates"]["epochs"]
    for name in ("stiffness_nm_rad", "stiffness_nm_rad_low"):
        assert [float(fit[name]) for fit in fits] == [fit[name] for fit in expected_fits]
    document = json.loads((place / f"{head}_acq-OFF_session.json").read_text())
    assert document == exported.about
    channels_file = motion / f"{head}_tracksys-motion_acq-OFF_channels.tsv"
    channels_file.write_text(channels_file.read_text().replace("JNTANG", "TORQUE"))
    assert any("TORQUE" in text or "TYPE" in text.upper() for text in errors(out))


def test_a_study_with_ratings_and_stimulation(fitted_study: Path, tmp_path: Path) -> None:
    study = Path(shutil.copytree(fitted_study, tmp_path / "study"))
    with (study / "study.toml").open("a") as file:
        about = 'age_years = 61\nsex = "F"\nbody_mass_kg = 7.7\nside = "R"\nimplant_target = "STN"'
        file.write(f'[subjects.M1]\n{about}\n[archive]\nauthors = ["A. Bee"]\n')
    (study / "exclusions.csv").write_text("path,epoch,reason,by\nsessions/2-DBS,1,cough,A\n")
    out = tmp_path / "bids"
    export_sessions(sessions_of_study(load_study(study), None), "bids", out)
    assert errors(out) == []
    assert rows(out / "participants.tsv") == [
        {
            "participant_id": "sub-M1",
            "age": "61.0",
            "sex": "F",
            "species": "homo sapiens",
            "body_mass_kg": "7.7",
            "side": "R",
            "implant_target": "STN",
        }
    ]
    days = {row["session_id"]: row for row in rows(out / "sub-M1" / "sub-M1_sessions.tsv")}
    assert list(days) == ["ses-1", "ses-2", "ses-3", "ses-4"]
    assert [days["ses-1"][f"rating_OFF_{who}"] for who in "ABC"] == ["2.0", "2.5", "2.0"]
    assert [days["ses-4"][f"rating_{key}"] for key in ("OFF_A", "DBS_A")] == ["n/a", "1.0"]
    motion = out / "sub-M1" / "ses-2" / "motion"
    first = rows(motion / "sub-M1_ses-2_task-rigidity_acq-DBS_events.tsv")[0]
    assert (first["excluded"], first["exclusion_reason"]) == ("true", "cough (A)")
    assert first["stimulation_frequency_hz"] == "130.0"
    off = rows(motion / "sub-M1_ses-2_task-rigidity_acq-OFF_events.tsv")[0]
    assert (off["trial_type"], off["condition"], off["excluded"]) == ("prbs", "OFF", "false")


def test_what_an_operator_wrote_is_no_formula_and_commands_no_terminal(exported, tmp_path) -> None:
    written = {"=1+1": "'=1+1", "-cough\x1b[31m": "'-cough\\x1b[31m", "\uff1d1": "'\uff1d1"}
    for number, (reason, cell) in enumerate(written.items()):
        (first, *others) = exported.about["epochs"]
        epochs = [{**first, "outcome": "excluded", "reason": reason}, *others]
        out = tmp_path / str(number)
        export_sessions(
            [replace(exported, about={**exported.about, "epochs": epochs})], "bids", out
        )
        (events,) = out.glob("sub-*/ses-*/motion/*_events.tsv")
        assert rows(events)[0]["exclusion_reason"] == cell
        assert float(rows(events)[0]["onset"]) == first["start_s"]
