"""A small archive: recordings of a known joint, a session, and what cannot be read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm


def write_recording(path: Path, seed: int, epochs: int = 2) -> Path:
    """Write epochs of 6 s of torque and angle at 200 samples/s."""
    time_s = np.arange(1200 * epochs) / 200.0
    table = np.column_stack([time_s, torque_nm(time_s, seed), angle_rad(time_s, seed)])
    label = np.repeat(np.arange(1, epochs + 1), 1200)
    np.savetxt(
        path,
        np.column_stack([table, label]),
        ["%.17g"] * 3 + ["%d"],
        delimiter=",",
        header="time_s,torque_nm,angle_rad,epoch",
        comments="",
    )
    return path


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Make a folder of three recordings, in a folder each."""
    folder = tmp_path / "archive"
    for seed in range(3):
        (folder / f"day-{seed}").mkdir(parents=True)
        write_recording(folder / f"day-{seed}" / "elbow.csv", seed)
    return folder


@pytest.fixture
def estimated(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Note every input that is estimated in this process."""
    from rigidimeter.analysis.batch import archive_run as run

    seen: list[Path] = []
    original: Callable = run.answer

    def noting(one, digest, how):
        seen.append(one.path)
        return original(one, digest, how)

    monkeypatch.setattr(run, "answer", noting)
    return seen
