"""A planned day on the virtual rig in real time: `run --next` from its wait to the next session."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from tests.small_study import tiny

from rigidimeter.core.files import toml_text
from rigidimeter.core.settings import dump_settings

PLAN = ("--subjects", "S01", "--days", "1", "--prbs-epochs", "1", "--sinusoid-epochs", "0")


def _rigidimeter(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "rigidimeter", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("day")
    shared = folder / "shared.toml"
    shared.write_text(toml_text(dump_settings(tiny("OFF", 1, epochs=1))))
    made = _rigidimeter(
        "study", "plan", f"{folder / 'study'}", *PLAN, "--settings", f"{shared}",
        "--order", "DBS,OFF", "--blinded",
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    assert not {"DBS", "OFF"} & {*made.stdout.split()}
    return folder / "study"


def test_a_planned_session_waits_runs_and_is_in_the_study(study: Path) -> None:
    due = ("run", "--next", f"{study}", "--unattended")
    refused = _rigidimeter(*due)
    assert refused.returncode == 1
    assert "has not begun" in refused.stderr
    ran = _rigidimeter(*due, "--stimulation", "on", "--clock-speed", "60000", "--operator", "AB")
    assert ran.returncode == 0, ran.stderr
    about = json.loads((study / "sessions/S01-day-1-1/manifest.json").read_text())["about"]
    place = about["plan"]
    assert place["since_change_min"] >= place["wait_min"] == 60.0
    assert (place["condition"], place["stimulation"], about["day"]) == ("DBS", "on", "1")
    assert (about["subject"], about["operator"]) == ("S01", "AB")
    assert "S01-day-1-1,S01,1,DBS" in (study / "sessions.csv").read_text()
    assert "Session 2 of 2 of S01" in ran.stdout
    # Nothing that an examiner sees names a condition: neither what is shown, nor a folder.
    assert not {"DBS", "OFF"} & {*ran.stdout.replace(",", " ").split(), *ran.stderr.split()}


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--next", "STUDY", "--out", "x"), "--out does not go with --next"),
        (("--next", "STUDY", "--subject", "S02"), "S02: is not in the plan; the plan has S01"),
        (("--next", "STUDY", "--block", "1/9"), "--block 1/9: the plan of S01 has no such"),
        (("--next", "STUDY", "--stimulation", "half"), "write on or off"),
        (("--next", "STUDY/none"), "has no plan; draw one with rigidimeter study plan"),
        (("--out", "x", "--stimulation", "on"), "--stimulation goes with --next STUDY alone"),
        ((), "--out is needed"),
    ],
)
def test_what_does_not_go_together_is_refused(
    study: Path, rigidimeter, options: tuple[str, ...], sentence: str
) -> None:
    ran = rigidimeter("run", *(option.replace("STUDY", str(study)) for option in options))
    assert ran.status == 1
    assert sentence in " ".join(ran.err.split())
