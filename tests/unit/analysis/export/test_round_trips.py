"""Session to format and back as anyone's file: the same epochs, and the same J, B, K."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.small_study import record

from rigidimeter.analysis.export import FORMATS, export_sessions, sessions_of_recording
from rigidimeter.analysis.reading import Recording, read
from rigidimeter.analysis.recording import estimate
from rigidimeter.core.records import PARAMETERS, Channel, Outcome

NAMES = {"nwb": "s.nwb", "mat": "s.mat"}
JITTER = {"rate_hz": 125.0, "jitter_s": 0.002}
KINDS = {
    "even": {},
    "jittered": {
        "rig": {"tick_rate_hz": 250.0, "torque": {**JITTER, "rate_hz": 250.0}, "motion": JITTER}
    },
    "sinusoid": {"task": "sinusoid"},
}


@pytest.fixture(scope="module", params=KINDS)
def recording(request, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    place = tmp_path_factory.mktemp("sessions") / request.param
    return read(record(place, "DBS", 2, **KINDS[request.param]))


def read_back(recording: Recording, to: str, place: Path) -> Recording:
    if to == "nwb":
        pytest.importorskip("pynwb")
    out = place / NAMES.get(to, to)
    sessions = sessions_of_recording(recording, None, subject="S1", day="1")
    export_sessions(sessions, to, out)
    tables = [out / f"{name}.{to}" for name in ("torque", "motion", "control")]
    joined = to in ("csv", "parquet")
    return read(tables if joined else out, join=joined, settings=recording.settings)


def in_common(*channels: Channel) -> list[Channel]:
    """Return the samples of channels in the time that they have in common."""
    start_s = max(channel.time_s[0] for channel in channels) - 1e-9
    stop_s = min(channel.time_s[-1] for channel in channels) + 1e-9
    rows = [slice(*np.searchsorted(each.time_s, (start_s, stop_s))) for each in channels]
    return [
        Channel(each.name, each.time_s[part], each.values[part])
        for each, part in zip(channels, rows, strict=True)
    ]


@pytest.mark.parametrize("to", [form.name for form in FORMATS])
def test_epochs_and_estimates(recording: Recording, tmp_path: Path, to: str) -> None:
    """Only samples at the two ends of an epoch may differ: which tick read them is not exported."""
    found = read_back(recording, to, tmp_path)
    assert found.notices == ()
    assert len(found.epochs) == len(recording.epochs) == 2
    for one, other in zip(found.epochs, recording.epochs, strict=True):
        assert (one.label, one.condition, one.task) == (other.label, "DBS", other.task)
        assert one.virtual == (to == "parquet")
        for name, whole in other.channels.items():
            ours, theirs = in_common(one.channels[name], whole)
            np.testing.assert_allclose(ours.time_s, theirs.time_s, rtol=0, atol=1e-9)
            np.testing.assert_array_equal(ours.values, theirs.values)
            assert len(ours) >= max(len(whole), len(one.channels[name])) - 3
    back, folder = estimate(found), estimate(recording)
    for fit, right in zip(back.fits, folder.fits, strict=True):
        for parameter in (each.name for each in PARAMETERS):
            difference = getattr(fit, parameter) - getattr(right, parameter)
            assert abs(difference) <= 0.1 * getattr(right, f"{parameter}_se")
    for score, right in zip(back.scores, folder.scores, strict=True):
        # The motion's frequency and start are found from it, not read.
        assert score.impulse_nm_s == pytest.approx(right.impulse_nm_s, rel=0.02)
        assert score.work_j == pytest.approx(right.work_j, rel=0.02)


@pytest.mark.parametrize("to", [form.name for form in FORMATS])
def test_an_epoch_that_does_not_count_is_not_read(session_folder, tmp_path, to: str) -> None:
    recording = read(session_folder)
    first, second = recording.epochs
    stopped = replace(first, closed=Outcome("excluded", "the subject coughed"))
    found = read_back(replace(recording, epochs=(stopped, second)), to, tmp_path)
    assert [epoch.label for epoch in found.epochs if epoch.closed.kind == "included"] == ["2"]
