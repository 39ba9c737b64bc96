"""NWB: the mapping, the inspector's verdict, and the numbers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from tests.unit.analysis.export.conftest import with_jitter

from rigidimeter.analysis.export import (
    ExportedSession,
    export_sessions,
    sessions_of_recording,
    sessions_of_study,
)
from rigidimeter.analysis.reading import read
from rigidimeter.analysis.study import load_study

pynwb = pytest.importorskip("pynwb", reason="pip install 'rigidimeter[nwb]'")


def written(session: ExportedSession, path: Path) -> Path:
    export_sessions([session], "nwb", path)
    return path


@pytest.fixture(scope="module")
def file_of_session(exported, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(exported, tmp_path_factory.mktemp("nwb") / "session.nwb")


def complaints(path: Path, validate: bool = True) -> list[str]:
    """Return what nwbinspector finds at the level of a violation of best practice or above.

    What pynwb finds not valid is among it.
    """
    inspector = pytest.importorskip("nwbinspector")
    found = inspector.inspect_nwbfile(
        nwbfile_path=path,
        skip_validate=not validate,
        importance_threshold=inspector.Importance.BEST_PRACTICE_VIOLATION,
    )
    return [f"{each.importance.name} {each.object_name}: {each.message}" for each in found]


def test_a_session_is_valid_and_the_inspector_is_content(file_of_session: Path) -> None:
    assert complaints(file_of_session) == []


def test_the_inspector_would_complain(exported, tmp_path: Path) -> None:
    """Of a subject without a sex, which archives need."""
    about = {**exported.about, "participant": {"sex": ""}}
    path = written(ExportedSession(about, exported.streams), tmp_path / "session.nwb")
    found = complaints(path, validate=False)
    assert any("CRITICAL" in text and "sex" in text for text in found)


def test_stamps_that_jitter_are_explicit_and_exact(exported, tmp_path: Path) -> None:
    session = with_jitter(exported)
    path = written(session, tmp_path / "session.nwb")
    assert complaints(path) == []
    torque = session.streams[0]
    with pynwb.NWBHDF5IO(path, "r") as io:
        series = io.read().acquisition["TorqueMeasured"]
        assert series.unit == "N·m"
        np.testing.assert_array_equal(series.timestamps[:], torque.time_s)
        np.testing.assert_array_equal(series.data[:], torque.columns["torque_nm"])


def test_even_stamps_are_a_rate(exported, file_of_session: Path) -> None:
    with pynwb.NWBHDF5IO(file_of_session, "r") as io:
        file = io.read()
        command = file.acquisition["AngularVelocityCommand"]
        assert command.rate == pytest.approx(250.0, rel=1e-9)
        time_s = command.starting_time + np.arange(command.data.shape[0]) / command.rate
        np.testing.assert_allclose(time_s, exported.streams[2].time_s, atol=1e-9)
        assert file.acquisition["ElbowAngle"].unit == "radians"
        assert "TorquePerturbation" in file.stimulus
        assert file.session_description.startswith("Simulated")
        assert file.subject.subject_id == "S1"


def test_tables_of_a_study(fitted_study: Path, tmp_path: Path) -> None:
    """A day with stimulation, of a subject whose age is known, with one epoch taken out."""
    import shutil

    study = Path(shutil.copytree(fitted_study, tmp_path / "study"))
    with (study / "study.toml").open("a") as file:
        about = 'age_years = 61\nsex = "F"\nbody_mass_kg = 7.7\nside = "R"\nimplant_target = "STN"'
        file.write(f'[subjects.M1]\n{about}\n[archive]\nauthors = ["A. Bee"]\n')
    (study / "exclusions.csv").write_text("path,epoch,reason,by\nsessions/2-DBS,1,cough,A\n")
    session = next(
        each
        for each in sessions_of_study(load_study(study), None)
        if (each.about["day"], each.about["condition"]) == ("2", "DBS")
    )
    path = written(session, tmp_path / "dbs.nwb")
    assert complaints(path) == []
    with pynwb.NWBHDF5IO(path, "r") as io:
        file = io.read()
        assert file.subject.weight == "7.7 kg"
        dbs = file.intervals["dbs_settings"].to_dataframe()
        row = dbs[["frequency_hz", "amplitude_ua", "pulse_width_us"]].iloc[0]
        assert row.tolist() == [130.0, 320.0, 60.0]
        trials = file.trials.to_dataframe()
        assert trials["rest"].tolist() == [False, True, False]
        assert trials["excluded"].tolist() == [True, False, False]
        assert trials["exclusion_reason"].iloc[0] == "cough (A)"
        ratings = file.processing["rigidimeter"]["ratings"].to_dataframe()
        assert ratings["score"].tolist() == [each["score"] for each in session.about["ratings"]]
        assert (file.subject.age, file.subject.sex) == ("P61Y", "F")
        assert file.experimenter == ("Bee, A.",)
        events = file.events["session_events"].to_dataframe()
        assert events["event"].tolist()[0] == "session_started"
        document = json.loads(file.scratch["rigidimeter_document"].data)
    assert document == session.about


def test_estimates_with_intervals(exported, file_of_session: Path) -> None:
    fits = exported.about["estimates"]["epochs"]
    with pynwb.NWBHDF5IO(file_of_session, "r") as io:
        table = io.read().processing["rigidimeter"]["estimates"].to_dataframe()
    for name in ("inertia_kg_m2", "damping_nm_s_rad_low", "stiffness_nm_rad_high"):
        assert table[name].tolist() == [fit[name] for fit in fits]


def test_a_file_of_another_program(tmp_path: Path) -> None:
    """Its joint and its date are unknown unless said."""
    time_s = np.arange(500) / 100
    rows = [f"{t},{np.cos(9 * t):.6f},{0.1 * np.sin(9 * t):.6f}" for t in time_s]
    source = tmp_path / "joint.csv"
    source.write_text("\n".join(["time_s,torque_nm,angle_rad", *rows]) + "\n")
    (session,) = sessions_of_recording(read(source), None)
    path = written(session, tmp_path / "joint.nwb")
    assert complaints(path) == []
    with pynwb.NWBHDF5IO(path, "r") as io:
        file = io.read()
        assert "JointAngle" in file.acquisition
        assert file.session_start_time.year == 1900
        assert "unknown" in file.notes
        assert "Simulated" not in file.session_description
