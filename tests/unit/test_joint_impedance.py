"""The benchmark of joint impedance: the same recordings everywhere, scores by hand, a true page."""

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.joint_impedance import measure, packages, recordings, score
from benchmarks.joint_impedance.__main__ import PAGE, RESULTS
from benchmarks.joint_impedance.page import page

import rigidimeter as rm

FOLDER = Path(score.__file__).parent


@pytest.mark.parametrize("name", ["relaxed", "low rates"])
def test_a_recording_has_its_digest_and_its_truth(name: str) -> None:
    made = recordings.recording(name, 1)
    (row,) = [r for r in recordings.truth_rows() if (r["scenario"], r["recording"]) == (name, "1")]
    assert made.digest == row["sha256"]
    assert made.truth == tuple(float(row[one]) for one in recordings.PARAMETERS)


def test_the_truth_has_every_recording_once() -> None:
    found = [(row["scenario"], row["recording"]) for row in recordings.truth_rows()]
    numbers = range(1, recordings.RECORDINGS + 1)
    assert found == [(name, str(k)) for name in recordings.SCENARIOS for k in numbers]


def test_a_recording_is_read_with_every_sample_of_every_sensor(tmp_path: Path) -> None:
    made = recordings.recording("low rates", 1)
    (tmp_path / made.name).write_text(made.text, encoding="utf-8")
    (epoch,) = rm.read(tmp_path / made.name).epochs
    (simulated,) = recordings.SCENARIOS["low rates"].simulated(1, 1).epochs
    for name in ("torque_nm", "angle_rad", "velocity_command_rad_s", "perturbation_nm"):
        assert len(epoch.channels[name]) == len(simulated.channels[name])
        step = 0.51 * 10.0 ** -recordings.DECIMALS[name]
        np.testing.assert_allclose(
            epoch.channels[name].values, simulated.channels[name].values, rtol=0, atol=step
        )


def row(recording: int, values, half: float | None = None, status: str = "used"):
    found = {"scenario": "s", "recording": str(recording), "status": status}
    for name, value in zip(score.PARAMETERS, values, strict=True):
        found[name] = str(value)
        found[f"{name}_low"] = "" if half is None else str(value - half)
        found[f"{name}_high"] = "" if half is None else str(value + half)
    return found


TRUTH = [row(k, (1.0, 2.0, 4.0)) for k in (1, 2, 3, 4)]


def test_scores_of_a_case_by_hand() -> None:
    """Errors of J: 0, +20 and −5 %; the fourth is withheld; the second is off, with a caution."""
    given = [
        row(1, (1.0, 2.0, 4.0), 0.02),
        row(2, (1.2, 2.0, 4.0), 0.1, "caution"),
        row(3, (0.95, 2.0, 4.8), 0.1),
    ]
    found = score.scores(given, TRUTH)["s"]
    assert found.recordings == 4
    np.testing.assert_allclose(found.bias, (0.0, 0.0, 0.0))
    # Percentiles 16 and 84 of three values lie 0.32 and 1.68 steps from the first.
    low, high = -0.05 + 0.32 * 0.05, 0.0 + 0.68 * 0.2
    np.testing.assert_allclose(found.scatter, ((high - low) / 2, 0.0, 0.68 * 0.2 / 2))
    np.testing.assert_allclose(found.coverage, (2 / 3, 1.0, 2 / 3))
    np.testing.assert_allclose(found.half_width, (0.1, 0.05, 0.025))
    assert (found.caution, found.withheld, found.silent) == (0.25, 0.25, 0.25)


def test_without_intervals_there_is_no_coverage_and_with_some_it_is_theirs() -> None:
    none = score.scores([row(1, (1.0, 2.0, 4.0))], TRUTH)["s"]
    assert np.isnan(none.coverage).all()
    assert none.withheld == 0.75
    assert score.cells(none)[2] == "– – –"
    some = [row(1, (1.0, 2.0, 4.0)), row(2, (1.0, 2.0, 4.0), 0.1)]
    np.testing.assert_allclose(score.scores(some, TRUTH)["s"].coverage, (1.0, 1.0, 1.0))


def test_a_scenario_without_any_estimate_has_only_withheld() -> None:
    found = score.scores([row(1, ("", "", ""), status="withheld")], TRUTH)["s"]
    assert np.isnan(found.bias).all()
    assert (found.withheld, found.silent) == (1.0, 0.0)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ([row(5, (1.0, 2.0, 4.0))], "there is no recording 5 of 's'"),
        ([row(1, (1.0, 2.0, 4.0))] * 2, "recording 1 of 's' has two rows"),
        ([row(1, (1.0, 2.0, 4.0), status="good")], "status 'good' is none of"),
    ],
)
def test_rows_that_cannot_be_scored_are_named(given, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        score.scores(given, TRUTH)


def test_the_scoring_needs_no_package_of_this_repository(tmp_path: Path) -> None:
    """A file of others, and one that is wrong, by the script alone."""
    given = {**row(1, (0.0045, 0.1368, 1.751), 0.1), "scenario": "relaxed"}
    for name, status in (("good", "used"), ("bad", "fine")):
        with (tmp_path / f"{name}.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, [*given])
            writer.writeheader()
            writer.writerow({**given, "status": status})
    command = [sys.executable, "-I", str(FOLDER / "score.py")]
    good, bad = (
        subprocess.run(
            [*command, str(tmp_path / f"{name}.csv")], capture_output=True, text=True, check=False
        )
        for name in ("good", "bad")
    )
    assert good.returncode == 0
    assert "relaxed | 20 | +0.0 +0.0 +0.0" in good.stdout
    assert bad.returncode == 1
    assert "status 'fine' is none of used, caution, withheld" in bad.stderr
    assert "Traceback" not in bad.stderr


def test_the_page_is_that_of_the_stored_results() -> None:
    truth = recordings.truth_rows()
    stored = measure.stored(RESULTS)
    assert [*stored] == [*packages.PACKAGES]
    scores = {name: score.scores(rows, truth) for name, rows in stored.items()}
    assert all([*own] == [*recordings.SCENARIOS] for own in scores.values())
    assert PAGE.read_text("utf-8") == page(scores)


def test_the_data_sheet_names_every_scenario_and_column() -> None:
    sheet = (FOLDER / "README.md").read_text("utf-8")
    named = [*recordings.SCENARIOS, *recordings.DECIMALS, *recordings.PARAMETERS, *score.STATUSES]
    assert [name for name in named if f"`{name}`" not in sheet] == []


def test_what_a_package_raises_is_withheld(tmp_path: Path) -> None:
    empty = tmp_path / "empty.csv"
    empty.write_text("time_s,torque_nm\n0,0\n", encoding="utf-8")
    for name in ("lstsq", "rigidimeter"):
        found = packages.estimate(name, empty)
        assert found.status == "withheld"
        assert found.reason
