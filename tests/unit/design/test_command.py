"""`rigidimeter design` from the outside, and the overview it prints."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from rigidimeter.cli.design import SCHEMA, design
from rigidimeter.design import overview, prbs_nm, sinusoid
from rigidimeter.errors import UserError
from rigidimeter.settings import Settings, parse_settings

app = typer.Typer()
app.command()(design)


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def test_prints_the_numbers() -> None:
    words = " ".join(run().split())
    for expected in (
        "7 bits (127 chips) at 20 Hz",
        "The wanted band 0.15–10 Hz is covered.",
        "peak speed 125.7 deg/s (guard: 200 deg/s)",
        "0.044 0.75 3.44 Eq. 8",
        "0.044 2.25 6.84 widest",
        "J_c 0.04584 kg·m²/rad (0.0008 kg·m²/deg)",
        "B_c 1.604 N·m·s/rad (0.028 N·m·s/deg)",
        "J_c/B_c 0.02857 s",
        "OFF, sinusoid: 4 epochs",
        "280 s (4.7 min) with the rests",
        "stays within the guard's limits",
    ):
        assert expected in words
    assert "Warning" not in words


def test_writes_what_will_be_commanded(tmp_path: Path) -> None:
    folder, numbers = tmp_path / "new" / "planned", tmp_path / "numbers.json"
    run("--out", str(folder), "--json", str(numbers))
    settings = Settings()
    columns = {
        name: np.loadtxt(folder / name, delimiter=",", skiprows=1, unpack=True)
        for name in ("prbs.csv", "sinusoid.csv")
    }
    np.testing.assert_array_equal(columns["prbs.csv"][0], np.arange(20_000) / 1000.0)
    np.testing.assert_array_equal(columns["prbs.csv"][1], prbs_nm(settings.prbs, 1000.0))
    np.testing.assert_array_equal(columns["sinusoid.csv"][1:], sinusoid(settings.sinusoid, 1000.0))
    assert (folder / "sinusoid.csv").read_text().startswith("time_s,angle_rad,velocity_rad_s\n")
    with (folder / "protocol.csv").open(newline="") as file:
        epochs = list(csv.DictReader(file))
    assert [epoch["label"] for epoch in epochs] == [str(n) for n in range(1, 9)]
    assert set(epochs[0]) == {"number", "label", "task", "condition", "duration_s", "rest_s"}

    document = json.loads(numbers.read_text())
    assert document == json.loads((folder / "design.json").read_text())
    assert document["schema"] == SCHEMA == "rigidimeter.design/1"
    assert document["prbs"]["covered"] is True
    assert len(document["bandwidth"]["corners"]) == 8
    assert document["protocol"]["total_s"] == 280.0
    assert document["controller"]["inertia_kg_m2_per_deg"] == pytest.approx(0.0008)
    assert document["controller"]["damping_nm_s_deg"] == pytest.approx(0.028)


def test_settings_change_the_plan_and_bring_warnings(tmp_path: Path) -> None:
    settings, numbers = tmp_path / "rig.toml", tmp_path / "numbers.json"
    settings.write_text(
        "[prbs]\nclock_hz = 8.0\n[controller]\ndamping_nm_s_rad = 0.0\n"
        "[guard]\nspeed_limit_deg_s = 100.0\n[sinusoid]\ntaper_s = 0.0\n"
    )
    text = " ".join(run("--settings", str(settings), "--json", str(numbers)).split())
    assert "is not covered" in text
    assert "prbs.clock_hz ≥ 16.6 Hz" in text
    assert "the sinusoid reaches a speed of 125.7 deg/s" in text
    assert "the sinusoid needs an acceleration" in text
    assert "velocity never settles" in text
    document = json.loads(numbers.read_text())
    assert document["controller"]["time_constant_s"] is None
    assert document["prbs"]["enough"]["clock_hz"] == 16.6
    assert len(document["warnings"]) == text.count("Warning:")


def test_mistakes_are_sentences(tmp_path: Path) -> None:
    occupied = tmp_path / "file"
    occupied.write_text("")
    with pytest.raises(UserError, match="cannot be made a folder"):
        run("--out", str(occupied))
    with pytest.raises(UserError, match="cannot be written"):
        run("--json", str(tmp_path))
    with pytest.raises(UserError, match="cannot be read"):
        run("--settings", str(tmp_path / "none.toml"))
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "prbs.csv").mkdir()
    with pytest.raises(UserError, match=r"prbs\.csv: cannot be written"):
        run("--out", str(tmp_path / "out"))


def test_help_needs_no_numerics() -> None:
    code = "import sys, rigidimeter.cli.design; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_overview_names_every_condition_of_the_settings() -> None:
    settings = parse_settings({"subject": {"OFF": {}, "levodopa": {}}})
    planned = overview(settings)
    assert list(planned.prbs_demand) == ["free arm", "subject OFF", "subject levodopa"]
    assert planned.warnings == ()
    assert not planned.perturbation_nm.flags.writeable
