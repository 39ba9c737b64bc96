"""Session to format and back: the same epochs, the same settings, the same estimates."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from tests.small_study import record

from rigidimeter.exporting import FORMATS, export_sessions, sessions_of_recording
from rigidimeter.recording import Recording, estimates_document, read
from rigidimeter.study import estimate

NEEDS = {"nwb": "pynwb", "xdf": "pyxdf"}
NAMES = {"nwb": "s.nwb", "xdf": "s.xdf", "mat": "s.mat"}
ALL = [form.name for form in FORMATS]


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Recording]:
    """Return sessions with even and with jittered stamps, and one of sinusoids."""
    place = tmp_path_factory.mktemp("sessions")
    jitter = {"rate_hz": 125.0, "jitter_s": 0.002}
    rig = {"tick_rate_hz": 250.0, "torque": {**jitter, "rate_hz": 250.0}, "motion": jitter}
    return {
        "even": read(record(place / "even", "OFF", 1, epochs=1)),
        "jittered": read(record(place / "jittered", "DBS", 2, epochs=1, rig=rig)),
        "sinusoid": read(record(place / "sinusoid", "OFF", 3, task="sinusoid", epochs=1)),
    }


@pytest.fixture(scope="module")
def back(
    recordings: dict[str, Recording], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str, str], Recording]:
    """Export a session to a format, once, and read it back."""

    @cache
    def exported(to: str, kind: str) -> Recording:
        if to in NEEDS:
            pytest.importorskip(NEEDS[to])
        out = tmp_path_factory.mktemp("exported") / NAMES.get(to, to)
        sessions = sessions_of_recording(recordings[kind], None, subject="S1", day="1")
        export_sessions(sessions, to, out)
        return read(out)

    return exported


@pytest.mark.parametrize("kind", ["even", "jittered", "sinusoid"])
@pytest.mark.parametrize("to", ALL)
def test_epochs_and_settings(recordings, back, to: str, kind: str) -> None:
    """Values to the bit; stamps too, but where a format has a rate for even ones."""
    recording = recordings[kind]
    found = back(to, kind)
    assert found.notices == recording.notices
    assert found.settings == recording.settings
    assert len(found.epochs) == len(recording.epochs)
    for one, other in zip(found.epochs, recording.epochs, strict=True):
        assert list(one.channels) == list(other.channels)
        for name, channel in one.channels.items():
            np.testing.assert_array_equal(channel.values, other.channels[name].values)
            stamps = other.channels[name].time_s
            np.testing.assert_allclose(channel.time_s, stamps, rtol=0, atol=1e-9)
        for field in ("label", "condition", "task", "excitation_hz", "closed", "virtual"):
            assert getattr(one, field) == getattr(other, field), field
        if other.motion is not None:
            assert one.motion == other.motion


def numbers(found: Any, path: str = "") -> dict[str, float]:
    """Return every number of a document by where it stands."""
    if isinstance(found, dict):
        parts = ((f"{path}.{key}", each) for key, each in found.items())
    elif isinstance(found, list):
        parts = ((f"{path}[{k}]", each) for k, each in enumerate(found))
    else:
        is_number = isinstance(found, int | float) and not isinstance(found, bool)
        return {path: float(found)} if is_number else {}
    return {place: value for name, each in parts for place, value in numbers(each, name).items()}


@pytest.mark.parametrize("kind", ["even", "jittered", "sinusoid"])
@pytest.mark.parametrize("to", ALL)
def test_estimates(estimates, back, to: str, kind: str) -> None:
    found = numbers(estimates_document(estimate(back(to, kind))))
    expected = estimates[kind]
    assert found.keys() == expected.keys()
    worst = max(
        abs(found[name] - value) / max(abs(value), 1e-12)
        for name, value in expected.items()
        if not math.isnan(value)
    )
    assert worst <= 1e-9


@pytest.fixture(scope="module")
def estimates(recordings) -> dict[str, dict[str, float]]:
    return {
        kind: numbers(estimates_document(estimate(recording)))
        for kind, recording in recordings.items()
    }
