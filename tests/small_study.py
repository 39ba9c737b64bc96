"""A small study on the virtual rig: three days in OFF, three in DBS, two short epochs each.

A plugin of the tests, so that its studies are made once for all of them.
"""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from rigidimeter.core.settings import parse_settings

TOML = """\
schema = "rigidimeter.study/1"
title = "Small study"
reference = "OFF"
other = "DBS"
[conditions.OFF]
title = "stimulation off"
[conditions.DBS]
title = "stimulation on"
frequency_hz = 130.0
amplitude_ma = 0.32
pulse_width_us = 60.0
"""
DAYS = {"OFF": ("1", "2", "3"), "DBS": ("2", "3", "4")}
EXAMINERS = {"A": 0.0, "B": 0.5, "C": 0.0}
RATED = {"OFF": 2.0, "DBS": 1.0}


def tiny(condition: str, seed: int, *, task: str = "prbs", epochs: int = 2, **tables):
    """Return settings of a session of a few seconds."""
    return parse_settings(
        {
            "seed": seed,
            "rig": {
                "tick_rate_hz": 250.0,
                "torque": {"rate_hz": 250.0},
                "motion": {"rate_hz": 125.0},
            },
            "prbs": {"duration_s": 6.0},
            "sinusoid": {
                "duration_s": 6.0,
                "motion_s": 6.0,
                "frequency_hz": 2.0,
                "taper_s": 0.5,
                "amplitude_deg": 8.0,
            },
            "scores": {"cycles": 4},
            "zeroing": {"duration_s": 0.2},
            "protocol": {
                "blocks": [
                    {"task": task, "condition": condition, "epochs": epochs},
                ],
                "rests_s": [0.5],
                "return_s": 0.5,
            },
            "subject": {
                "OFF": {"damping_cv_percent": 10.0, "stiffness_cv_percent": 10.0},
                "DBS": {
                    "damping_nm_s_rad": 0.11,
                    "stiffness_nm_rad": 1.3,
                    "damping_cv_percent": 10.0,
                    "stiffness_cv_percent": 10.0,
                },
            },
            **tables,
        }
    )


def record(folder: Path, condition: str, seed: int, **changes) -> Path:
    """Record a session of a few seconds."""
    from tests.replayed import assert_folder_replayed

    from rigidimeter.virtual import run_virtual_session

    run_virtual_session(tiny(condition, seed, **changes), folder)
    assert_folder_replayed(folder)
    return folder


def build(folder: Path, task: str) -> Path:
    """Write the whole study: sessions of one task, ratings, study.toml."""
    (folder / "sessions").mkdir(parents=True)
    sessions, ratings = ["path,subject,day,condition"], ["subject,day,condition,examiner,score"]
    for k, condition in enumerate(DAYS):
        for day in DAYS[condition]:
            path = f"sessions/{day}-{condition}"
            record(folder / path, condition, seed=100 * k + int(day), task=task)
            sessions.append(f"{path},M1,{day},{condition}")
            for examiner, offset in EXAMINERS.items():
                odd = 0.5 if day + examiner in ("2A", "3C", "4B") else 0.0
                score = RATED[condition] + offset + odd
                ratings.append(f"M1,{day},{condition},{examiner},{score}")
    (folder / "study.toml").write_text(TOML)
    (folder / "sessions.csv").write_text("\n".join(sessions) + "\n")
    (folder / "ratings.csv").write_text("\n".join(ratings) + "\n")
    return folder


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], Path]) -> Path:
    """Return a folder that one of the processes of this run made for all of them."""
    place = factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        place = place.parent
    with (place / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (place / name).exists():
            make(place / f"{name}.part").rename(place / name)
    return place / name


@pytest.fixture(scope="session")
def fitted_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the study of PRBS epochs once; it is not to be changed."""
    return made_once(tmp_path_factory, "fitted", lambda folder: build(folder, "prbs"))


@pytest.fixture(scope="session")
def scored_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the study of sinusoidal epochs once: scores cost nothing, so tests are fast."""
    return made_once(tmp_path_factory, "scored", lambda folder: build(folder, "sinusoid"))


@pytest.fixture
def study(scored_study: Path, tmp_path: Path) -> Path:
    """Return a copy of the study of scores that a test may change."""
    return Path(shutil.copytree(scored_study, tmp_path / "study"))


@pytest.fixture
def edit() -> Callable[[Path, str, str], None]:
    """Replace one piece of a text file, which must be there."""

    def change(path: Path, old: str, new: str) -> None:
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))

    return change
