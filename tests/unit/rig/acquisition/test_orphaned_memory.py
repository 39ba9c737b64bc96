"""Shared memory goes with the last process that has it, unless it holds what is in no file."""

import subprocess
import sys
import time

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import Sample, SessionWriter, read_events, read_samples, recover
from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition.processes import (
    PREFIX,
    Memory,
    ProcessCondition,
    RingSink,
    Role,
    SessionMemory,
    complete_left,
    orphaned_memory,
    session_memory,
    shared_memory,
)


@pytest.fixture(autouse=True)
def where(tmp_path, monkeypatch):
    """A place for shared memory that no other session on this machine has."""
    where = tmp_path / "shm"
    where.mkdir()
    for module in (shared_memory, session_memory, orphaned_memory):
        monkeypatch.setattr(module, "WHERE", where)
    return where


@pytest.fixture
def made(tmp_path, where):
    """Memory of a session of 150 samples, of which 100 are in the folder; no writer lives."""
    shared = SessionMemory.create(100.0, 10.0)
    writer = SessionWriter(tmp_path / "s", Settings(), [], {}, virtual=True)
    shared.status.show_folder(tmp_path / "s")
    sink = RingSink(shared, 100.0)
    sink.event("session_started", time_s=0.0)
    for tick in range(150):
        sink.sample(sample(tick))
    rows = shared.samples.rows(0, 100)
    writer.columns({name: rows[name] for name in rows.dtype.names})
    shared.samples.recorded = 100
    writer._log._file.close()
    writer._events.close()
    yield shared
    if not shared.samples.memory.closed:
        shared.close()


def sample(tick: int) -> Sample:
    return Sample(tick, tick / 100.0, 0.0, -1, *[0.5] * 9, 0)


def there(shared: SessionMemory) -> list[bool]:
    return [(shared_memory.WHERE / name).exists() for name in shared.names]


def test_the_last_one_removes_it(made):
    other = SessionMemory.attach(made.names)
    made.samples.recorded = made.samples.written
    made.events.recorded = made.events.written
    other.leave()
    assert there(made) == [True] * 3
    made.leave()
    assert there(made) == [False] * 3


def test_what_is_in_no_file_stays(made):
    made.leave()
    assert there(made) == [True] * 3


def test_what_came_after_the_end_of_the_record_does_not_stay(made):
    made.status.set_condition(Role.RECORDER, ProcessCondition.DONE)
    made.leave()
    assert there(made) == [False] * 3


def test_what_was_left_is_brought_into_its_folder_once(made, tmp_path):
    made.close()
    assert complete_left(tmp_path / "another") == []
    (told,) = complete_left(tmp_path / "s", "a power cut")
    assert told == f"{tmp_path / 's'}: 50 samples that were only in memory were brought in"
    assert there(made) == [False] * 3
    assert read_samples(tmp_path / "s" / "samples.arrows")["tick"].tolist() == list(range(150))
    events, _ = read_events(tmp_path / "s" / "events.jsonl")
    assert events[-1]["reason"] == "a power cut"
    assert complete_left(tmp_path / "s") == []


def test_a_living_process_keeps_it(made, where, tmp_path, monkeypatch):
    monkeypatch.setattr(orphaned_memory, "LEAVING_S", 0.1)
    holder = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import sys, pathlib; from rigidimeter.rig.acquisition.processes import shared_memory\n"
            "shared_memory.WHERE = pathlib.Path(sys.argv[2])\n"
            "memory = shared_memory.Memory.attach(sys.argv[1])\n"
            "print('has it', flush=True); sys.stdin.read()",
            made.status.name,
            str(where),
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert holder.stdout.readline() == b"has it\n"
    made.close()
    with pytest.raises(UserError, match="still being recorded"):
        complete_left(tmp_path / "s")
    assert complete_left() == []
    assert there(made) == [True] * 3
    holder.kill()
    holder.communicate()
    assert len(complete_left(tmp_path / "s")) == 1


def test_a_folder_that_cannot_be_completed_is_named_and_the_memory_kept(made, tmp_path):
    made.close()
    (tmp_path / "s" / "manifest.json").unlink()
    with pytest.raises(UserError, match="50 samples of this session wait in memory"):
        complete_left(tmp_path / "s")
    (told,) = complete_left()  # it keeps no other session from running
    assert made.samples.name in told
    assert there(made) == [True] * 3


def test_memory_of_no_folder_is_removed_whatever_is_in_it():
    shared = SessionMemory.create(100.0, 1.0)
    shared.samples.push(sample(0))
    shared.close()
    assert complete_left() == []
    assert there(shared) == [False] * 3


def test_a_record_that_was_closed_is_not_gone_on_with(made, tmp_path):
    made.close()
    recover(tmp_path / "s", "closed before")
    before = {path.name: path.read_bytes() for path in (tmp_path / "s").iterdir()}
    complete_left(tmp_path / "s")
    assert before == {path.name: path.read_bytes() for path in (tmp_path / "s").iterdir()}
    assert there(made) == [False] * 3


def test_parts_of_a_set_that_was_never_complete_are_removed_but_not_at_once(where, monkeypatch):
    memory = Memory.create(64, f"{PREFIX}unfinished-samples")
    memory.close()
    path = where / memory.name
    complete_left(path)
    assert path.exists()
    monkeypatch.setattr(orphaned_memory, "MAKING_S", -1.0)
    time.sleep(0.01)
    complete_left(path)
    assert not path.exists()
