"""`rigidimeter design` from the outside."""

import csv
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from tests.unit.virtual.tiny import tiny
from typer.testing import CliRunner

from rigidimeter.cli.design import design
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, load_settings
from rigidimeter.core.study_files import read_plan
from rigidimeter.planning import DESIGN_SCHEMA, multisine_nm, prbs_nm, sinusoid
from rigidimeter.virtual import write_virtual_study

app = typer.Typer()
app.command()(design)


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def test_prints_the_numbers() -> None:
    words = " ".join(run("--full").split())
    for expected in (
        "Prbs register bits 7 clock, Hz 20.00",
        "The wanted band 0.15–10 Hz is covered.",
        "peak speed, deg/s 125.7",
        "speed limit, deg/s 200.0",
        "damping, N·m·s/rad 0.04400 stiffness, N·m/rad 0.7500 bandwidth, Hz 3.444",
        "stiffness, N·m/rad 2.250 bandwidth, Hz 6.844",
        "inertia, kg·m² 0.04584",
        "inertia, 10⁻³ kg·m²/deg 0.8000",
        "damping, N·m·s/deg 0.02800",
        "time constant, s 0.02857",
        "task prbs sinusoid condition OFF OFF epochs 4 4",
        "total, s 304.0",
        "stays within the guard's limits",
    ):
        assert expected in words
    assert "Warning" not in words


def test_the_bandwidth_of_another_subject(tmp_path: Path) -> None:
    numbers = tmp_path / "numbers.json"
    words = " ".join(run("--full", "--body-mass", "80", "--json", str(numbers)).split())
    assert "Bandwidth: forearm body mass, kg 80.00 length, m 0.1500" in words
    bandwidth = json.loads(numbers.read_text())["bandwidth"]
    assert bandwidth["forearm"] == {"body_mass_kg": 80.0, "length_m": 0.15}
    assert bandwidth["nominal"]["inertia_kg_m2"] == pytest.approx(0.009 + 0.0048)


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
    assert document["schema"] == DESIGN_SCHEMA == "rigidimeter.design/3"
    assert document["prbs"]["covered"] is True
    assert len(document["bandwidth"]["corners"]) == 8
    assert document["protocol"]["total_s"] == 304.0
    assert document["controller"]["inertia_kg_m2_per_deg"] == pytest.approx(0.0008)
    assert document["controller"]["damping_nm_s_deg"] == pytest.approx(0.028)


def test_settings_change_the_plan_and_bring_warnings(tmp_path: Path) -> None:
    settings, numbers = tmp_path / "rig.toml", tmp_path / "numbers.json"
    settings.write_text(
        "[prbs]\nclock_hz = 8.0\n[controller]\ndamping_nm_s_rad = 0.0\n"
        "[margins]\ngain_margin_db = 0.0\nphase_margin_deg = 0.0\n"
        "[guard]\nspeed_limit_deg_s = 100.0\n[sinusoid]\ntaper_s = 0.0\n"
    )
    text = " ".join(run("--full", "--settings", str(settings), "--json", str(numbers)).split())
    assert "is not covered" in text
    assert "prbs.clock_hz ≥ 16.6 Hz" in text
    assert "the sinusoid reaches a speed of 125.7 deg/s" in text
    assert "the sinusoid needs an acceleration" in text
    assert "time constant, s –" in text  # without damping the free arm's velocity never settles
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


def test_prints_what_is_predicted() -> None:
    words = " ".join(run("--full").split())
    for expected in (
        "conditions worst",
        "OFF gain margin, dB 28.28 16.16",
        "OFF phase margin, deg 92.06 109.2",
        "OFF delay margin, s 1.472 6.588",
        "iv, 0.1–30 Hz 0.0028 (0.062 %) 0.000087 (0.064 %) 0.00047 (0.027 %)",
        "least squares, 0.0036 (0.079 %) 0.000092 (0.067 %) 0.00055 (0.031 %) passive arm,",
        "iv, 4 epochs pooled",
    ):
        assert expected in words
    assert "would bias least squares" not in words


def test_the_subjects_own_torque_biases_least_squares(tmp_path: Path) -> None:
    settings = tmp_path / "rig.toml"
    settings.write_text("[subject.OFF]\nvoluntary_sd_nm = 0.2\n")
    words = " ".join(run("--full", "--settings", str(settings)).split())
    assert "would bias least squares without weights: J by -43 %, B by -69 %, K by +3 %" in words


def test_searches_and_compares(tmp_path: Path) -> None:
    settings, folder = tmp_path / "rig.toml", tmp_path / "planned"
    settings.write_text("[optimise]\nclocks = 2\nbits_low = 7\nbits_high = 7\n")
    text = run(
        "--full", "--settings", str(settings), "--out", str(folder), "--optimise", "--criterion",
        "D", "--multisine",
    )  # fmt: skip
    words = " ".join(text.split())
    assert "Best PRBS of 2 (D): 7 bits at" in words
    assert "Optimised 1 2 register bits 7 7" in words
    assert "Multisine crest factor 1.494" in words
    assert {path.name for path in folder.iterdir()} == {
        "prbs.csv", "sinusoid.csv", "protocol.csv", "bode.svg", "multisine.csv", "optimised.toml",
        "design.json", "data-dictionary.csv",
    }  # fmt: skip
    snippet = (folder / "optimised.toml").read_text()
    assert all(f"    {line}" in text.splitlines() for line in snippet.splitlines())
    best = load_settings(folder / "optimised.toml")
    document = json.loads((folder / "design.json").read_text())
    assert document["optimised"][0]["amplitude_nm"] == best.prbs.amplitude_nm
    columns = np.loadtxt(folder / "multisine.csv", delimiter=",", skiprows=1, unpack=True)
    np.testing.assert_array_equal(columns[1], multisine_nm(Settings()))
    assert set(document["multisine"]["standard_errors"]["OFF"]) == {
        "prbs", "same_peak_torque", "same_angle_sd", "same_peak_angle",
    }  # fmt: skip
    assert (folder / "bode.svg").read_text().startswith("<?xml")


def test_an_unstable_loop_is_refused_after_it_is_shown(tmp_path: Path, rigidimeter) -> None:
    settings, folder = tmp_path / "rig.toml", tmp_path / "planned"
    settings.write_text("[controller]\ninertia_kg_m2 = 0.0008\ndamping_nm_s_rad = 0.028\n")
    ran = rigidimeter(
        "design", "--settings", settings, "--out", folder, "--optimise", "--multisine",
        "--detect", "damping=20%", "--full",
    )  # fmt: skip
    assert ran.status == 1
    assert ran.err.startswith("rigidimeter: the loop is unstable with subject OFF: a dist")
    assert ran.err.count("\n") == 1
    assert "UNSTABLE" in ran.out
    assert "no standard errors, since the loop is unstable" in " ".join(ran.out.split())
    document = json.loads((folder / "design.json").read_text())
    assert document["stability"]["conditions"]["OFF"]["stable"] is False
    assert document["optimised"] is None
    assert document["detection"] == []
    assert (folder / "bode.svg").exists()


def test_nearly_unstable_is_said_and_refused(tmp_path: Path) -> None:
    settings, numbers = tmp_path / "rig.toml", tmp_path / "numbers.json"
    settings.write_text("[controller]\ninertia_kg_m2 = 0.003\ndamping_nm_s_rad = 0.105\n")
    with pytest.raises(UserError, match=r"less than margins\.gain_margin_db = 6 dB; raise"):
        run("--settings", str(settings), "--json", str(numbers))
    # All is shown and written before it is refused.
    warnings = json.loads(numbers.read_text())["warnings"]
    assert any("the loop with subject OFF" in warning for warning in warnings)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--detect", "rigidity=20%"), 'unknown parameter "rigidity"; known: inertia'),
        (("--criterion", "best"), "the criterion 'best' is unknown"),
        (("--detect", "damping=20%", "--power", "1.5"), "--power 1.5"),
    ],
)
def test_bad_values_of_options_are_sentences(arguments: tuple[str, ...], words: str) -> None:
    with pytest.raises(UserError, match=words):
        run(*arguments)


def test_help_needs_no_numerics() -> None:
    code = "import sys, rigidimeter.cli.design; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_first_screen_has_the_perturbation_the_loop_the_errors_and_the_days(tmp_path) -> None:
    settings, numbers = Path("examples/settings/study.toml"), tmp_path / "numbers.json"
    wanted = [
        word
        for name in ("damping=20%", "stiffness=20%", "inertia=5%")
        for word in ("--detect", name)
    ]
    text = run("--settings", str(settings), *wanted, "--json", str(numbers))
    lines = text.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80
    assert lines[0].startswith(
        "PRBS     ±1 N·m, 127 chips at 20 Hz, 20 s; SD of the angle OFF 4.7°"
    )
    assert lines[1] == "loop     stable, margins 28.3 dB and 91.9°; worst joint 16.2 dB and 107°"
    assert " OFF  4.50 ± 0.16 %  0.137 ± 0.44 %  1.75 ± 0.2 %" in lines
    (damping, *_) = json.loads(numbers.read_text())["detection"]
    row = next(line.split() for line in lines if "damping −20 %: days" in line)
    each = [*damping["needed"], damping["planned"]]
    assert [int(cell) for cell in row[4:]] == [one["days_needed"] for one in each]
    assert damping["unit"] == "N·m·s/rad"
    assert damping["planned"]["epochs_a_day"] == [3, 3]
    words = " ".join(text.split())
    assert "primary measures: stiffness and damping, by Holm (level 0.05)" in words
    assert "damping 12 % between epochs (subject.OFF), 6.4 % of condition by day (chosen)" in words


def test_without_a_difference_it_names_the_option_that_asks_for_days() -> None:
    lines = run().splitlines()
    assert len(lines) < 12
    assert lines[-1].startswith("--detect damping=20%: the days, epochs and subjects it takes")


def test_what_was_searched_has_a_line_each(tmp_path: Path) -> None:
    settings = tmp_path / "rig.toml"
    settings.write_text("[optimise]\nclocks = 2\nbits_low = 7\nbits_high = 7\n")
    words = " ".join(run("--settings", str(settings), "--optimise", "--multisine").split())
    assert "Best PRBS of 2 (minimax): 7 bits at " in words
    assert (
        "Multisine of the same peak torque: standard errors J 1.49, B 1.35, K 1.75 times" in words
    )


def test_the_scatter_comes_from_a_study(tmp_path: Path) -> None:
    small_study, numbers = tmp_path / "study", tmp_path / "numbers.json"
    write_virtual_study(small_study, tiny(prbs=4), 1, processes=1)
    text = run("--detect", "stiffness=20%", "--from", str(small_study), "--json", str(numbers))
    (found,) = json.loads(numbers.read_text())["detection"]
    scatter = found["scatter"]
    assert scatter["source"] == f"{small_study}, 8 epochs, 2 days with both conditions"
    assert 0 < scatter["between_epochs_percent"] < 60
    assert not (small_study / "analysis").exists()
    assert f"stiffness {scatter['between_epochs_percent']:.2g} % between epochs, " in text


def test_a_study_without_days_of_both_conditions_has_half_the_variance(tmp_path: Path) -> None:
    off, dbs = tiny(prbs=4).conditions
    apart = replace(tiny(), conditions=(replace(off, days=(1, 2)), replace(dbs, days=(3, 4))))
    study, numbers = tmp_path / "study", tmp_path / "numbers.json"
    write_virtual_study(study, apart, 1, processes=1)
    run("--detect", "damping=20%", "--from", str(study), "--json", str(numbers))
    (found,) = json.loads(numbers.read_text())["detection"]
    scatter = found["scatter"]
    of_days = scatter["between_days_percent"]
    assert scatter["condition_in_day_percent"] == pytest.approx(of_days * 0.5**0.5)
    assert "no two days with both conditions" in scatter["source"]


def test_a_study_of_one_day_cannot_say_how_days_differ(tmp_path: Path) -> None:
    one_day = tuple(replace(each, days=(1,)) for each in tiny(prbs=2).conditions)
    study = tmp_path / "study"
    write_virtual_study(study, replace(tiny(), conditions=one_day), 1, processes=1)
    with pytest.raises(UserError, match=r"how much J differs between days is unknown"):
        run("--detect", "damping=20%", "--from", str(study))


def test_a_folder_that_is_no_study_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"--from .*: is no study folder: it has no study\.toml"):
        run("--detect", "stiffness=20%", "--from", str(tmp_path))


def test_a_plan_of_days_is_drawn_from_the_days_that_a_design_asks_for(
    tmp_path: Path, rigidimeter
) -> None:
    numbers, study = tmp_path / "design.json", tmp_path / "study"
    settings = "examples/settings/study.toml"
    run("--settings", settings, "--detect", "stiffness=20%", "--json", str(numbers))
    needed = json.loads(numbers.read_text())["detection"][0]["planned"]
    ran = rigidimeter("study", "plan", study, "--subjects", "S01", "--from-design", numbers)
    assert ran.status == 0, ran.err
    plan = read_plan(study)
    assert plan is not None
    assert plan.about.days == needed["days_needed"]
    block = load_settings(study / "protocols/OFF.toml").protocol.blocks[0]
    assert (block.task, block.epochs) == ("prbs", max(needed["epochs_a_day"]))
    run("--json", str(numbers))
    refused = rigidimeter(
        "study", "plan", tmp_path / "b", "--subjects", "S", "--from-design", numbers
    )
    assert refused.status == 1
    assert "names no days; run design with --detect" in " ".join(refused.err.split())
