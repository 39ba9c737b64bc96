"""A recording of the streams of a session is the session."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.small_study import record

from rigidimeter.analysis.reading import read
from rigidimeter.analysis.reading.formats.lsl_recording import (
    epochs_of_samples,
    settings_of_samples,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import json_text
from rigidimeter.core.records import Epoch
from rigidimeter.core.session import marker_of, read_session_files
from rigidimeter.core.settings import dump_settings


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    jitter = {"rate_hz": 125.0, "jitter_s": 0.002}
    rig = {"tick_rate_hz": 250.0, "torque": {**jitter, "rate_hz": 250.0}, "motion": jitter}
    return record(tmp_path_factory.mktemp("lsl") / "session", "DBS", 2, rig=rig)


@pytest.fixture
def received(session: Path) -> dict[str, Any]:
    """Return what a recorder of the streams holds, its times 1000 s later."""
    files = read_session_files(session)
    columns = {name: values.astype(float) for name, values in files.samples.columns.items()}
    markers = [(1000.0 + event["time_s"], marker_of(event)) for event in files.log.events]
    settings = json_text(dump_settings(read(session).settings))
    facts = {"settings": [settings], "virtual": ["true"], "session_id": ["x"]}
    return {"columns": columns, "markers": markers, "described": {"rigidimeter": [facts]}}


def assert_same_epochs(found: Sequence[Epoch], expected: Sequence[Epoch]) -> None:
    """Hold epochs equal to the bit in all but where they come from."""
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        assert list(one.channels) == list(other.channels)
        for name, channel in one.channels.items():
            np.testing.assert_array_equal(channel.time_s, other.channels[name].time_s)
            np.testing.assert_array_equal(channel.values, other.channels[name].values)
        for field in dataclasses.fields(Epoch):
            if field.name not in ("channels", "source"):
                assert getattr(one, field.name) == getattr(other, field.name), field.name


def test_the_epochs_are_those_of_the_folder(session: Path, received) -> None:
    epochs, notices = epochs_of_samples("there", **received)
    assert notices == []
    assert_same_epochs(epochs, read(session).epochs)
    assert settings_of_samples(received["described"], "there") == read(session).settings


def test_a_stream_from_before_there_were_all_columns_is_read(session: Path, received) -> None:
    for name in ("cause", "drive_torque_nm", "drive_torque_time_s", "reported_cause"):
        del received["columns"][name]
    epochs, notices = epochs_of_samples("there", **received)
    assert notices == []
    assert_same_epochs(epochs, read(session).epochs)
    del received["columns"]["torque_nm"]
    with pytest.raises(UserError, match="has no channel torque_nm"):
        epochs_of_samples("there", **received)


def test_samples_that_were_not_received_are_counted(session: Path, received) -> None:
    columns = {
        name: np.delete(values, slice(100, 150)) for name, values in received["columns"].items()
    }
    epochs, (notice,) = epochs_of_samples("there", **{**received, "columns": columns})
    assert notice.level == "warning"
    assert "50 ticks are not in the recording" in notice.text
    assert len(epochs) == 2
    # What was sent in them is not known; in the other epoch every tick is.
    assert [epoch.ticks for epoch in epochs] == [None, read(session).epochs[1].ticks]


def test_missed_ticks_are_not_taken_for_lost(received) -> None:
    columns = {
        name: np.delete(values, slice(100, 150)) for name, values in received["columns"].items()
    }
    columns["lateness_s"][100] = 50.2 / 250.0
    epochs, notices = epochs_of_samples("there", **{**received, "columns": columns})
    assert notices == []
    assert (epochs[0].ticks.late, epochs[0].ticks.missed) == (1, 50)


def test_an_epoch_whose_end_was_not_received_does_not_count(received) -> None:
    markers = [each for each in received["markers"] if each[1] != "epoch_end/2/success"]
    epochs, _ = epochs_of_samples("there", **{**received, "markers": markers})
    assert [epoch.closed.kind for epoch in epochs] == ["included", "excluded"]
    assert epochs[1].closed.reason == "it ended with no marker"


def test_a_recording_that_began_late_has_the_epochs_that_it_knows(received) -> None:
    """Without the first start marker and all of the first epoch."""
    samples = received["columns"]
    kept = samples["epoch"] != 1
    columns = {name: values[kept] for name, values in samples.items()}
    markers = [each for each in received["markers"] if each[0] > 1006.2]
    epochs, _ = epochs_of_samples("there", columns, markers, received["described"])
    assert [epoch.label for epoch in epochs] == ["2"]
    assert epochs[0].condition == "DBS"


def test_a_stream_without_settings_is_refused(received) -> None:
    with pytest.raises(UserError, match="does not hold its settings"):
        epochs_of_samples("there", received["columns"], received["markers"], {})
