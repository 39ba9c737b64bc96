"""The folder: what `compare` reads, the same bytes from any number of processes."""

from __future__ import annotations

import csv
import math
import multiprocessing
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from tests.unit.virtual.tiny import SHORT, tiny

import rigidimeter as rm
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import read_session, session_settings
from rigidimeter.virtual import PAPER, PUSHING, plan_study, study_length_s, write_virtual_study


def bytes_of(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("virtual") / "study"
    write_virtual_study(place, tiny(), 3, processes=1)
    return place


def test_two_processes_write_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    """Though one of them is killed in the middle."""
    seen: list[float] = []

    def progress(time_s: float) -> None:
        if not seen:
            multiprocessing.active_children()[0].kill()
        seen.append(time_s)

    write_virtual_study(tmp_path / "study", tiny(), 3, processes=2, progress=progress)
    one, two = bytes_of(folder), bytes_of(tmp_path / "study")
    assert one == two
    assert len(one) == 4 * 3 + 4  # with the data dictionary
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(study_length_s(plan_study(tiny(), 3)))


@pytest.mark.parametrize("processes", [1, 2])
def test_an_interrupted_study_leaves_nothing_that_looks_whole(
    tmp_path: Path, processes: int
) -> None:
    def interrupt(time_s: float) -> None:
        if time_s > 10.0:
            raise KeyboardInterrupt

    place = tmp_path / "study"
    with pytest.raises(KeyboardInterrupt):
        write_virtual_study(place, tiny(), 3, processes=processes, progress=interrupt)
    assert not place.exists()


def test_what_a_kill_left_is_named(tmp_path: Path) -> None:
    (tmp_path / "sessions").mkdir()
    with pytest.raises(UserError, match=r"not finished: it has no study.toml; remove it"):
        write_virtual_study(tmp_path, tiny(), 3, processes=1)


def test_the_tables_name_every_session(folder: Path) -> None:
    study = tomllib.loads((folder / "study.toml").read_text(encoding="utf-8"))
    assert study["schema"] == "rigidimeter.study/1"
    assert (study["reference"], study["other"]) == ("OFF", "DBS")
    simulated = study["simulated"]
    assert study["conditions"]["DBS"] == {
        "title": "stimulation on",
        "frequency_hz": 130.0,
        "amplitude_ma": 0.32,
        "pulse_width_us": 60.0,
        "wash_in_min": 15.0,
        "electrodes": "bipolar",
    }
    assert [simulated[name]["stiffness_nm_rad"] for name in ("OFF", "DBS")] == [1.751, 1.44]
    assert [simulated[name]["damping_nm_s_rad"] for name in ("OFF", "DBS")] == [0.1368, 0.119]
    assert simulated["OFF"]["inertia_kg_m2"] == simulated["DBS"]["inertia_kg_m2"] == 0.0045
    # 20 deg at 1 Hz: π B ω A² and 4 A |K − J ω² + i B ω| / ω; a third of a point by 2 · ½ ln(…).
    A, omega = math.radians(20.0), 2 * math.pi
    impedance = complex(1.44 - 0.0045 * omega**2, 0.119 * omega)
    assert simulated["DBS"]["work_j"] == pytest.approx(math.pi * 0.119 * omega * A**2, rel=1e-5)
    expected = 4 * A * abs(impedance) / omega
    assert simulated["DBS"]["impulse_nm_s"] == pytest.approx(expected, rel=1e-5)
    fall = math.log(0.119 / 0.1368) + math.log(1.44 / 1.751)
    assert simulated["DBS"]["rating"] == pytest.approx(2.0 + fall, rel=1e-5)
    assert study["rating"] == {"scale": [0.0, 3.0], "step": 0.5}
    sessions = rows_of(folder / study["sessions"])
    assert [(row["day"], row["condition"]) for row in sessions] == [
        ("1", "OFF"), ("1", "DBS"), ("2", "DBS"), ("2", "OFF"),
    ]  # fmt: skip
    for row in sessions:
        epochs, notices = read_session(folder / row["path"])
        assert not [notice for notice in notices if notice.level == "error"]
        assert {epoch.condition for epoch in epochs} == {row["condition"]}
        assert sorted(epoch.task for epoch in epochs) == ["prbs", "sinusoid"]
        assert all(epoch.virtual for epoch in epochs)
    ratings = rows_of(folder / study["ratings"])
    assert len(ratings) == 4 * 3
    assert ratings[0].keys() == {"subject", "day", "condition", "examiner", "score"}


def test_its_sessions_are_estimated_and_compared(folder: Path) -> None:
    paths = [folder / row["path"] for row in rows_of(folder / "sessions.csv")]
    epochs = [epoch for path in paths for epoch in read_session(path)[0]]
    found = rm.compare(rm.estimate(epochs, settings=session_settings(paths[0])), resamples=0)
    assert all(one.n == (2, 2) for one in found.comparisons)
    inertia = found.summaries("inertia_kg_m2")
    assert inertia["OFF"].median == pytest.approx(0.0045, rel=0.15)


def test_nothing_is_written_over(folder: Path) -> None:
    with pytest.raises(UserError, match="is there already"):
        write_virtual_study(folder, tiny(), 3, processes=1)


def test_a_session_that_fails_is_named(tmp_path: Path) -> None:
    impossible = {**SHORT, "zeroing": {"duration_s": 0.1, "bias_limit_nm": 0.001}}
    noisy = {**impossible, "rig": {"torque": {"noise_sd_nm": 5.0}}}
    with pytest.raises(UserError, match="day-1-OFF: the session ended with fail"):
        write_virtual_study(tmp_path / "study", replace(tiny(), settings=noisy), 3, processes=1)
    assert not (tmp_path / "study" / "study.toml").exists()


@pytest.mark.slow
def test_pushing_moves_the_published_estimate_and_not_the_instrumental_one(
    tmp_path: Path,
) -> None:
    """Equal joints; in DBS the subject pushes with a fifth of the perturbation."""
    design = replace(
        tiny(PUSHING, prbs=6, sinusoid=0),
        settings=PAPER.settings,
        **{
            f"{level}_{what}_cv_percent": 0.0
            for level in ("day", "epoch")
            for what in ("inertia", "damping", "stiffness")
        },
    )
    plans = write_virtual_study(tmp_path / "study", design, 3, processes=1)
    epochs = [e for plan in plans for e in read_session(tmp_path / "study" / plan.folder)[0]]
    shift_percent = {}
    for method in ("published", "iv"):
        estimates = rm.estimate(epochs, method, settings=plans[0].settings)
        damping = rm.compare(estimates, resamples=0).summaries("damping_nm_s_rad")
        shift_percent[method] = 100 * (damping["DBS"].median / damping["OFF"].median - 1)
    assert shift_percent["published"] < -30.0
    assert abs(shift_percent["iv"]) < 15.0  # six epochs with 0.2 N·m: an SE of about 6 %
