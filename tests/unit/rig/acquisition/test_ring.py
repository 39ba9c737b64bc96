import multiprocessing
import time

import numpy as np
import pytest
from tests.file_size import file_size_limit

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import Sample, sample_dtypes
from rigidimeter.rig.acquisition.processes import (
    ROW,
    EventRing,
    Memory,
    SampleReader,
    SampleRing,
    shared_memory,
)


def sample(k: int) -> Sample:
    devices = k, 1 << 40, -1, 0, k % 31, k / 4, k / 8
    return Sample(k, *[k + 0.5] * 2, k % 3 - 1, *[k + 0.25] * 9, k % 5, *devices)


@pytest.fixture
def ring():
    ring = SampleRing.create(8)
    yield ring
    ring.memory.unlink()
    ring.close()


@pytest.fixture
def events():
    events = EventRing.create(capacity=4, slot_bytes=128)
    yield events
    events.memory.unlink()
    events.close()


def test_a_row_has_the_columns_of_a_sample():
    assert ROW.names == Sample._fields == tuple(sample_dtypes())


def test_rows_come_back_as_they_were_also_around_the_end(ring):
    for k in range(20):
        assert ring.push(sample(k))
        ring.recorded = max(0, k - 5)
    rows = ring.rows(13, 20)
    assert [tuple(row) for row in rows.tolist()] == [tuple(sample(k)) for k in range(13, 20)]
    assert ring.held_rows()["tick"].tolist() == list(range(12, 20))


def test_the_writer_neither_waits_nor_writes_over_what_is_not_recorded(ring):
    taken = [ring.push(sample(k)) for k in range(11)]
    assert taken == [True] * 8 + [False] * 3
    assert (ring.lag(), ring.refused) == (8, 3)
    assert ring.held_rows()["tick"].tolist() == list(range(8))
    ring.recorded = 2
    assert ring.push(sample(8))
    assert ring.rows(2, 9)["tick"].tolist() == list(range(2, 9))


def test_a_reader_that_is_overtaken_learns_how_much_it_missed(ring):
    reader = SampleReader(ring)
    for k in range(5):
        ring.push(sample(k))
    rows, missed = reader.read()
    assert (rows["tick"].tolist(), missed) == ([0, 1, 2, 3, 4], 0)
    for k in range(5, 30):
        ring.recorded = ring.written
        ring.push(sample(k))
    rows, missed = reader.read()
    # The oldest slot may be the one that is being written, so it does not count.
    assert (rows["tick"].tolist(), missed) == (list(range(23, 30)), 18)
    rows, missed = reader.read()
    assert (rows.size, missed) == (0, 0)


def test_a_reader_may_skip_to_the_newest(ring):
    reader = SampleReader(ring)
    for k in range(6):
        ring.push(sample(k))
    rows, missed = reader.read(max_rows=2)
    assert (rows["tick"].tolist(), missed) == ([4, 5], 4)


def test_a_reader_overtaken_while_it_copies_gives_up_what_is_torn(ring, monkeypatch):
    reader = SampleReader(ring)
    for k in range(7):
        ring.push(sample(k))
    copy = ring.rows

    def slow(first, stop):
        rows = copy(first, stop)
        ring.recorded = ring.written
        for k in range(7, 11):
            ring.push(sample(k))
        return rows

    monkeypatch.setattr(ring, "rows", slow)
    rows, missed = reader.read()
    assert (rows["tick"].tolist(), missed) == ([4, 5, 6], 4)


def test_events_keep_their_place_among_the_samples(events):
    for k in range(3):
        assert events.push(10 * k, {"event": "e", "number": k, "text": "µ"})
    assert [events.get(k).samples_before for k in range(3)] == [0, 10, 20]
    assert events.get(2).facts == {"event": "e", "number": 2, "text": "µ"}
    assert events.get(1).line == '{"event": "e", "number": 1, "text": "µ"}\n'.encode()


def test_an_event_without_room_is_counted(events):
    assert [events.push(0, {"event": "e"}) for _ in range(6)] == [True] * 4 + [False] * 2
    assert events.refused == 2
    events.recorded = 1
    assert events.push(0, {"event": "e"})


def test_an_event_that_is_too_long_is_an_error_of_the_writer(events):
    with pytest.raises(ValueError, match=r"event e takes 1\d\d bytes; a slot .* holds 112"):
        events.push(0, {"event": "e", "text": "x" * 120})
    assert events.written == 0


def test_attaching_to_something_else_is_refused(ring, events):
    with pytest.raises(ValueError, match="holds something else"):
        SampleRing.attach(events.name)
    again = SampleRing.attach(ring.name)
    ring.push(sample(3))
    assert again.rows(0, 1)["tick"].tolist() == [3]
    again.close()
    with pytest.raises(FileNotFoundError):
        SampleRing.attach("rigidimeter-none")


def test_memory_may_be_closed_and_unlinked_twice():
    memory = Memory.create(64)
    other = Memory.attach(memory.name)
    for each in (other, memory, memory, other):
        each.close()
        each.unlink()


def test_memory_that_is_not_there_is_refused_with_its_size(tmp_path, monkeypatch):
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    with (
        file_size_limit(1_000_000),
        pytest.raises(UserError, match=r"no \d\.\d MB of shared memory .*\(File too large\)"),
    ):
        SampleRing.create(30_000)
    assert list(tmp_path.iterdir()) == []


def write(name: str, count: int) -> None:
    ring = SampleRing.attach(name)
    for k in range(count):
        ring.recorded = ring.written
        ring.push(sample(k))
    ring.close()


def test_no_row_is_torn_while_another_process_writes():
    ring = SampleRing.create(64)
    reader = SampleReader(ring)
    # Fork, so that the writer needs no import; it uses nothing but the ring.
    process = multiprocessing.get_context("fork").Process(target=write, args=(ring.name, 50_000))
    process.start()
    seen = missed = 0
    until_s = time.monotonic() + 30.0
    while seen + missed < 50_000 and time.monotonic() < until_s:
        rows, skipped = reader.read()
        missed += skipped
        if rows.size:
            np.testing.assert_array_equal(
                rows["tick"], np.arange(seen + missed, seen + missed + rows.size)
            )
            np.testing.assert_array_equal(rows["time_s"], rows["tick"] + 0.5)
            np.testing.assert_array_equal(rows["torque_sequence"], rows["tick"])
            np.testing.assert_array_equal(rows["cause"], rows["tick"] % 31)
            seen += rows.size
    process.join()
    assert seen + missed == 50_000
    assert seen > 0
    ring.memory.unlink()
    ring.close()
