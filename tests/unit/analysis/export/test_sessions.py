"""What is given away of a session, a recording and a study."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from rigidimeter.analysis.export import sessions_of_recording, sessions_of_study
from rigidimeter.analysis.reading import read
from rigidimeter.analysis.study import estimate_study, load_study
from rigidimeter.core.files import json_text
from rigidimeter.core.session import read_session_files
from rigidimeter.core.settings import parse_settings


def test_every_sample_of_a_session_is_given(session_folder, exported) -> None:
    """A reading that was held goes once; what the loop recorded goes for every tick."""
    samples = read_session_files(session_folder).samples.columns
    by_name = {stream.name: stream for stream in exported.streams}
    control = by_name.pop("control")
    np.testing.assert_array_equal(control.time_s, samples["time_s"])
    for name, stream in by_name.items():
        stamps = np.unique(samples[f"{name}_time_s"])
        np.testing.assert_array_equal(stream.time_s, stamps)
    given = {name for stream in exported.streams for name in stream.columns}
    assert {*samples} - given == {"time_s", "torque_time_s", "motion_time_s", "epoch"}


def test_what_is_known_travels_along(exported) -> None:
    about = exported.about
    assert about["virtual"] is True
    assert about["software"].startswith("rigidimeter ")
    assert (about["subject"], about["day"], about["condition"]) == ("S1", "day 1", "OFF")
    assert about["settings"]["controller"]["inertia_kg_m2"] > 0
    assert about["settings"]["prbs"]["duration_s"] == 6.0
    first = about["estimates"]["epochs"][0]
    low, high = first["stiffness_nm_rad_low"], first["stiffness_nm_rad_high"]
    assert low < first["stiffness_nm_rad"] < high
    assert about["units"]["torque_nm"] == "N·m"


def test_a_file_of_two_clocks_keeps_both(tmp_path: Path) -> None:
    """Torque at 100 Hz and angle at 50 Hz, in rows of their own."""
    rows = ["time_s,torque_nm,angle_rad,epoch,condition"]
    for k in range(400):
        angle = f"{0.1 * np.sin(0.3 * k):.6f}" if k % 2 == 0 else ""
        rows.append(f"{k / 100},{np.cos(0.3 * k):.6f},{angle},{1 + k // 200},DBS")
    path = tmp_path / "joint.csv"
    path.write_text("\n".join(rows) + "\n")
    recording = read(path)
    (session,) = sessions_of_recording(recording, None)
    assert [stream.name for stream in session.streams] == ["torque", "motion"]
    assert session.about["virtual"] is False
    assert session.about["condition"] == "DBS"
    assert [epoch["label"] for epoch in session.about["epochs"]] == ["1", "2"]
    torque, motion = session.streams
    assert (torque.time_s.size, motion.time_s.size) == (400, 200)


@pytest.fixture(scope="module")
def study(fitted_study: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the small study with an exclusion of its operator."""
    folder = Path(shutil.copytree(fitted_study, tmp_path_factory.mktemp("shared") / "study"))
    (folder / "exclusions.csv").write_text("path,epoch,reason,by\nsessions/1-OFF,2,cough,A. B.\n")
    return folder


def test_a_study_gives_stimulation_ratings_and_exclusions(study: Path) -> None:
    read_one = load_study(study, method="bandlimited")
    analysis, _ = estimate_study(read_one)
    sessions = sessions_of_study(read_one, analysis)
    assert len(sessions) == 6
    first = sessions[0].about
    assert (first["subject"], first["day"], first["condition"]) == ("M1", "1", "OFF")
    assert first["stimulation"]["DBS"] == {
        "title": "stimulation on",
        "frequency_hz": 130.0,
        "amplitude_ma": 0.32,
        "pulse_width_us": 60.0,
    }
    assert [each["score"] for each in first["ratings"]] == [2.0, 2.5, 2.0]
    assert first["operator_exclusions"] == [{"epoch": "2", "by": "A. B.", "reason": "cough"}]
    assert first["epochs"][1]["outcome"] == "excluded"
    assert first["epochs"][1]["reason"] == "cough (A. B.)"
    fits = [fit for session in sessions for fit in session.about["estimates"]["epochs"]]
    assert [fit["stiffness_nm_rad"] for fit in fits] == [
        fit.stiffness_nm_rad for fit in analysis.fits
    ]


def test_a_blinded_study_gives_nothing_that_tells_the_condition(study: Path) -> None:
    """Paths, plans and simulated joints name conditions; of these words none may be there."""
    for name in ("sessions.csv", "ratings.csv"):
        table = (study / name).read_text().splitlines()
        coded = [line.replace(",OFF", ",blue").replace(",DBS", ",red") for line in table]
        (study / name).write_text("\n".join(coded) + "\n")
    sessions = sessions_of_study(load_study(study), None)
    for session in sessions:
        text = json_text(session.about)
        assert session.about["blinded"] is True
        assert session.about["condition"] in ("blue", "red")
        assert "OFF" not in text
        assert "DBS" not in text
        assert "true_joint" not in text
        conditions = {epoch["condition"] for epoch in session.about["epochs"]}
        assert conditions == {session.about["condition"]}
        parse_settings(session.about["settings"])  # complete without what was taken out
