import errno
import json
import os
from types import SimpleNamespace

import numpy as np
import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import append_line
from rigidimeter.core.session import Sample, read_events, read_samples
from rigidimeter.core.session import folder as folder_module
from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition.processes import (
    EventRing,
    Flag,
    Patience,
    ProcessCondition,
    Recorder,
    RecordingPlan,
    RingSink,
    Role,
    SampleRing,
    SessionMemory,
    SharedStatus,
    recorder,
    recover_from_rings,
)

RATE_HZ = 1000.0


def sample(k: int) -> Sample:
    return Sample(k, k / RATE_HZ, 0.0, 1, *[k + 0.5] * 9, 0)


class Rig:
    def __init__(self, folder, capacity=1000):
        self.folder = folder
        self.samples, self.events = SampleRing.create(capacity), EventRing.create(32, 512)
        self.shared_status = SharedStatus.create()
        self.shared = SessionMemory(self.samples, self.events, self.shared_status)
        self.sink = RingSink(self.shared, RATE_HZ)
        self.writer = RecordingPlan(folder, Settings(), virtual=True).writer()
        self.recorder = Recorder(self.writer, self.shared, RATE_HZ)
        self.tick = 0

    def run(self, ticks):
        for _ in range(ticks):
            self.sink.sample(sample(self.tick))
            self.tick += 1

    def begin(self):
        self.sink.event("session_started", time_s=0.0)
        named = {"label": "one", "task": "prbs", "condition": "rest"}
        self.sink.event("epoch_started", epoch=1, **named, time_s=0.0)

    def end(self):
        time_s = self.tick / RATE_HZ
        self.sink.event("epoch_ended", epoch=1, time_s=time_s, outcome="success", reason="")
        self.sink.close(self.tick / RATE_HZ, "success", "")

    def kill(self):
        """Leave the files as a recorder does that was killed."""
        for file in (self.writer._log._file, self.writer._events):
            file.close()

    def recover_from_rings(self):
        return recover_from_rings(self.folder, self.shared, "the recorder was killed", RATE_HZ)

    def ticks(self):
        columns = read_samples(self.folder / "samples.arrows")
        np.testing.assert_array_equal(columns["tick"], np.arange(columns["tick"].size))
        np.testing.assert_array_equal(columns["torque_nm"], columns["tick"] + 0.5)
        return columns["tick"].size

    def kinds(self):
        events, torn = read_events(self.folder / "events.jsonl")
        assert not torn
        return [event["event"] for event in events]

    def close(self):
        if not self.writer._events.closed:
            self.kill()
        for part in (self.samples, self.events, self.shared_status):
            part.memory.unlink()
            part.close()


@pytest.fixture
def rig(tmp_path):
    rig = Rig(tmp_path / "s")
    yield rig
    rig.close()


def test_everything_is_recorded(rig):
    rig.begin()
    for _ in range(7):
        rig.run(333)
        rig.recorder.drain()
        assert (rig.samples.lag(), rig.events.lag()) == (0, 0)
    rig.end()
    rig.recorder.drain()
    assert rig.recorder.ended
    assert rig.ticks() == 7 * 333
    assert rig.kinds() == ["session_started", "epoch_started", "epoch_ended", "session_ended"]


def noted(rig):
    """Return a list that gets the kind of each event and the number of each sample, as written."""
    order, columns, line = [], rig.writer.columns, rig.writer.line

    def write_columns(values):
        columns(values)
        order.extend(values["tick"].tolist())

    def write_line(text):
        line(text)
        order.append(json.loads(text)["event"])

    rig.writer.columns, rig.writer.line = write_columns, write_line
    return order


def test_samples_are_written_before_the_event_that_follows_them(rig):
    order = noted(rig)
    rig.begin()
    rig.run(3)
    rig.end()
    rig.recorder.drain()
    ended = ["epoch_ended", "session_ended"]
    assert order == ["session_started", "epoch_started", 0, 1, 2, *ended]


def test_an_event_counts_as_recorded_when_it_is_written_whatever_fails_after_it(rig):
    """Else a recorder that goes on, or whoever completes the session, would write it again."""
    rig.begin()
    rig.recorder.drain()
    rig.sink.event("epoch_started", epoch="one")  # of which the recorder cannot take the number
    rig.sink.event("note", text="later")
    with pytest.raises(ValueError, match="one"):
        rig.recorder.drain()
    rig.recorder.drain()
    rig.end()
    rig.recorder.drain()
    lines = (rig.folder / "events.jsonl").read_text().splitlines()
    assert [json.loads(line)["event"] for line in lines] == [
        *("session_started", "epoch_started", "epoch_started", "note"),
        *("epoch_ended", "session_ended"),
    ]
    assert rig.events.recorded == rig.events.written


def test_and_events_before_the_samples_that_follow_them(rig):
    """Though the loop goes on while the recorder looks how many there are."""
    order = noted(rig)

    class Busy(EventRing):
        looked = False

        @property
        def written(self):
            count = super().written
            if not self.looked:
                self.looked = True
                rig.begin()
                rig.run(1)
            return count

    rig.recorder._events = busy = Busy.attach(rig.events.name)
    rig.recorder.drain()
    rig.recorder.drain()
    assert order == ["session_started", "epoch_started", 0]
    busy.close()


def test_a_loop_that_died_leaves_a_closed_session(rig):
    rig.begin()
    rig.run(50)
    rig.recorder.drain()
    rig.recorder.close("the loop died")
    rig.recorder.drain()
    events, _ = read_events(rig.folder / "events.jsonl")
    assert [(e["event"], e.get("outcome"), e.get("reason")) for e in events[-2:]] == [
        ("epoch_ended", "fail", "the loop died"),
        ("session_ended", "fail", "the loop died"),
    ]
    assert rig.ticks() == 50


@pytest.mark.parametrize("room", [0, 1, 500, 5000])
def test_a_full_disk_loses_and_repeats_nothing(rig, room, monkeypatch):
    rig.begin()
    rig.run(50)
    rig.recorder.drain()
    left = room

    class Full:
        """A file that takes only so many bytes more, and says so as the system does."""

        def __init__(self, file):
            self._file = file

        def write(self, data):
            nonlocal left
            if left == 0:
                raise OSError(errno.ENOSPC, "No space left on device")
            n = self._file.write(data[:left])
            left -= n
            return n

        def __getattr__(self, name):
            return getattr(self._file, name)

    file, events = rig.writer._log._file, rig.writer._events
    rig.writer._log._file, rig.writer._events = Full(file), Full(events)
    rig.run(500)
    rig.end()
    for _ in range(3):
        with pytest.raises(OSError, match="No space"):
            rig.recorder.drain()
    assert rig.samples.lag() > 0
    assert rig.ticks() == rig.samples.recorded
    rig.writer._log._file, rig.writer._events = file, events
    rig.recorder.drain()
    assert rig.recorder.ended
    assert rig.ticks() == 550
    assert rig.kinds() == ["session_started", "epoch_started", "epoch_ended", "session_ended"]


FULL = OSError(errno.ENOSPC, "No space left on device")


@pytest.fixture
def disk(rig, monkeypatch):
    """Give what the recorder knows of its disk, and a clock that stands still."""
    clock = SimpleNamespace(now_s=1000.0)
    clock.monotonic = lambda: clock.now_s
    monkeypatch.setattr(recorder, "time", clock)
    recording = RecordingPlan(rig.folder, Settings(), virtual=True)
    disk = recorder.FullDisk(recording, rig.shared, Patience(), os.getppid())
    return disk, clock


@pytest.mark.parametrize("closing", [False, True])
def test_a_disk_is_given_up_once_the_session_is_over_and_somebody_said_so(rig, disk, closing):
    disk, clock = disk
    status, allowed_s = rig.shared_status, Patience().disk_s

    def given_up_after(seconds, *, over=closing):
        clock.now_s += seconds
        return disk.given_up(over=over)

    disk.refuses(FULL)
    assert not given_up_after(0.0)
    assert not given_up_after(2 * allowed_s, over=True)  # there may be room yet, or another folder
    status.raise_flag(Flag.END_ASKED)
    assert not given_up_after(0.0, over=False)
    assert not given_up_after(2 * allowed_s, over=False)  # the loop runs
    if not closing:
        status.set_condition(Role.LOOP, ProcessCondition.DONE)
    assert not given_up_after(0.0)
    assert not given_up_after(allowed_s)
    assert given_up_after(1e-3)


def test_a_disk_that_took_something_again_is_tried_as_long_as_before(rig, disk):
    disk, clock = disk
    rig.shared_status.raise_flag(Flag.END_ASKED)
    disk.refuses(FULL)
    assert not disk.given_up(over=True)
    clock.now_s += Patience().disk_s - 1.0
    disk.takes(rig.recorder)
    assert not disk.given_up(over=True)
    disk.refuses(FULL)
    clock.now_s += 2.0
    assert not disk.given_up(over=True)


def test_a_session_that_ended_on_a_full_disk_is_whole_in_another_folder(rig, disk, tmp_path):
    disk, _ = disk
    rig.begin()
    rig.run(250)
    rig.end()
    close, rig.writer.close_files = rig.writer.close_files, lambda: (_ for _ in ()).throw(FULL)
    with pytest.raises(OSError, match="No space"):
        rig.recorder.drain()
    disk.refuses(FULL)
    assert disk.other_folder() is None
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "file").touch()
    rig.shared_status.ask_folder(tmp_path / "taken")
    assert disk.other_folder() is None
    disk.refuses(FULL)
    assert f"(not {tmp_path / 'taken'}: " in rig.shared_status.note(Role.RECORDER)
    old, rig.folder = rig.folder, tmp_path / "other"
    rig.shared_status.ask_folder(rig.folder)
    rig.recorder.move(disk.other_folder())
    rig.recorder.drain()
    disk.takes(rig.recorder)
    assert disk.other_folder() is None  # as long as no other is asked for
    assert rig.recorder.ended
    assert rig.shared_status.folder() == rig.folder
    assert rig.ticks() == 250
    assert rig.kinds()[-1] == "session_ended"
    assert rig.kinds().count("session_ended") == 1
    events, _ = read_events(rig.folder / "events.jsonl")
    assert [e["from"] for e in events if e["event"] == "recording_moved"] == [str(old)]
    disk.refuses(FULL)
    note = rig.shared_status.note(Role.RECORDER)
    assert note.startswith(f"{rig.folder}: nothing can be written there")
    assert "(not " not in note
    close()


def test_samples_that_found_no_room_are_told(rig):
    rig.begin()
    rig.run(1100)
    rig.end()
    rig.recorder.drain()
    events, _ = read_events(rig.folder / "events.jsonl")
    assert events[-2]["event"] == "record_lost"
    assert events[-2]["samples"] == 100


@pytest.mark.parametrize("cursor_behind", [False, True])
@pytest.mark.parametrize("torn", [0, 700])
def test_recovery_completes_the_folder_once(rig, cursor_behind, torn):
    rig.begin()
    rig.run(900)
    rig.recorder.drain()
    rig.run(350)
    rig.recorder.drain()
    if cursor_behind:  # killed after a write, before its cursor moved
        rig.samples.recorded -= 100
        rig.events.recorded -= 1
    if torn:  # killed within a write
        with (rig.folder / "samples.arrows").open("ab", buffering=0) as file:
            append_line(file, b"\xff\xff\xff\xff\x18\x01\x00\x00" + bytes(torn))
        with (rig.folder / "events.jsonl").open("ab", buffering=0) as file:
            append_line(file, b'{"event": "epoch_en')
    rig.run(123)
    rig.end()
    rig.kill()
    found = rig.recover_from_rings()
    assert (found.samples, found.events, found.missing_samples) == (123, 2, 0)
    assert rig.ticks() == 1373
    assert [kind for kind in rig.kinds() if kind != "record_salvaged"] == [
        "session_started",
        "epoch_started",
        "epoch_ended",
        "session_ended",
    ]
    before = (rig.folder / "samples.arrows").read_bytes(), rig.kinds()
    assert rig.recover_from_rings().samples == 0
    assert before == ((rig.folder / "samples.arrows").read_bytes(), rig.kinds())


def test_recovery_closes_what_the_loop_did_not(rig):
    rig.begin()
    rig.run(123)
    rig.kill()
    assert rig.recover_from_rings().samples == 123
    events, _ = read_events(rig.folder / "events.jsonl")
    assert events[-1]["outcome"] == "fail"
    assert events[-1]["reason"] == "the recorder was killed"
    assert rig.ticks() == 123


def test_recovery_leaves_a_living_recorder_alone(rig):
    rig.begin()
    rig.run(10)
    with pytest.raises(UserError, match="still being recorded"):
        rig.recover_from_rings()
    assert folder_module.EVENTS == "events.jsonl"
