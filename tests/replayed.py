"""Every session of the tests is replayed: the guard finds again what it found.

`sessions_replayed` is imported by the `conftest.py` of each folder whose tests run sessions in
their own process. Sessions in other processes are replayed from their folder, by
`assert_folder_replayed`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from rigidimeter.core.session import Sample, sample_dtypes
from rigidimeter.rig.acquisition import Replay, replay, replay_session, session_run

COUNTED = {"run": 0, "replayed": 0}
"""Sessions of this process since it began."""


def assert_same(found: Replay) -> Replay:
    """Assert that record and replay agree, and that nothing was left out."""
    assert not found.differences, "\n".join(map(str, found.differences))
    assert not found.left_out, found.left_out
    return found


def assert_folder_replayed(folder: Path) -> Replay:
    """Replay a session folder."""
    found = assert_same(replay_session(folder))
    assert found.ticks
    return found


class Recorded(session_run.ControllerRun):
    """A run whose samples and events are also kept here."""

    kept: ClassVar[list[Recorded]] = []

    def __init__(
        self, settings: Any, rig: Any, clock: Any, sink: Any, *others: Any, **more: Any
    ) -> None:
        super().__init__(settings, rig, clock, sink, *others, **more)
        self.settings, self.samples, self.events = settings, [], []
        record, event = self.loop.record, sink.event

        def sample(one: Sample) -> None:
            record(one)
            self.samples.append(one)

        def kept_event(kind: str, **facts: Any) -> None:
            self.events.append({"event": kind, **facts})
            event(kind, **facts)

        self.loop.record = sample
        sink.event = kept_event
        COUNTED["run"] += 1
        self.kept.append(self)

    def replayed(self) -> Replay:
        """Replay what was recorded."""
        columns = {
            name: np.array([getattr(sample, name) for sample in self.samples], dtype)
            for name, dtype in sample_dtypes().items()
        }
        return replay(self.settings, columns, self.events, Sample._fields)


@pytest.fixture(autouse=True)
def sessions_replayed(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Replay each session that a test ran in this process, once the test is over."""
    Recorded.kept = []
    monkeypatch.setattr(session_run, "ControllerRun", Recorded)
    yield
    for run in Recorded.kept:
        COUNTED["replayed"] += 1
        if request.node.get_closest_marker("not_replayed") is None:
            assert_same(run.replayed())
    Recorded.kept = []
