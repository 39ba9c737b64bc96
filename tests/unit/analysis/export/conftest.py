from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from tests.small_study import record

from rigidimeter.analysis.export import ExportedSession, sessions_of_recording
from rigidimeter.analysis.reading import read
from rigidimeter.analysis.recording import estimate


@pytest.fixture(scope="session")
def session_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record a session whose torque, motion and loop have three clocks."""
    return record(tmp_path_factory.mktemp("exported") / "session", "OFF", 1)


@pytest.fixture(scope="session")
def exported(session_folder: Path) -> ExportedSession:
    recording = read(session_folder)
    (session,) = sessions_of_recording(recording, estimate(recording), subject="S1", day="day 1")
    return session


def with_jitter(session: ExportedSession, seed: int = 1) -> ExportedSession:
    """Return a session whose stamps are not even, and whose epochs are as they were."""
    rng = np.random.default_rng(seed)
    shifts = [rng.uniform(-2e-4, 2e-4, stream.time_s.size) for stream in session.streams]
    streams = tuple(
        dataclasses.replace(stream, time_s=stream.time_s + shift)
        for stream, shift in zip(session.streams, shifts, strict=True)
    )
    return ExportedSession(session.about, streams)
