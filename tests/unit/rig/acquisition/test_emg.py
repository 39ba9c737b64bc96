"""EMG is recorded in a process of its own: what a stream sends, and what is missing of it."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import Sample, SessionWriter, read_emg
from rigidimeter.core.settings import EmgSettings, Settings, parse_settings
from rigidimeter.model import LiveEnvelope, VirtualMuscles
from rigidimeter.rig.acquisition.processes import (
    LoopStatus,
    ProcessCondition,
    Role,
    SessionMemory,
    emg_main,
)
from rigidimeter.rig.console import EnvelopeReader
from rigidimeter.rig.devices import DaqEmg, ReaderError, open_emg, require_emg
from rigidimeter.rig.devices.base import EmgSamples

CONFIG = """\
[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
[lab]
KnownPeers = {127.0.0.1}
"""
AMPLIFIER = """\
import sys, time
import numpy as np
from pylsl import StreamInfo, StreamOutlet, local_clock
name, rate_hz, channels, pauses = sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), sys.argv[4:]
out = StreamOutlet(StreamInfo(name, "EMG", channels, rate_hz, "double64", name + "-source"))
print("ready", flush=True)
out.wait_for_consumers(60.0)
start_s, sent = local_clock(), 0
while True:
    now = int((local_clock() - start_s) * rate_hz)
    count = np.arange(sent, now)
    if count.size and not (pauses and 1.0 < local_clock() - start_s < 2.5):
        values = np.column_stack([1000.0 * k + count % 1000 for k in range(channels)])
        out.push_chunk(values, (start_s + count / rate_hz).tolist())
    sent = now
    time.sleep(0.02)
"""


@pytest.fixture
def amplifier(tmp_path: Path, monkeypatch) -> Iterator[Any]:
    """Start an outlet in a process of its own; give a function that does so."""
    pytest.importorskip("pylsl", reason="pip install 'rigidimeter[lsl]'")
    (tmp_path / "lsl.cfg").write_text(CONFIG)
    monkeypatch.setenv("LSLAPICFG", str(tmp_path / "lsl.cfg"))
    started: list[subprocess.Popen[bytes]] = []

    def start(name: str, rate_hz: float, channels: int, *pauses: str) -> None:
        command = [sys.executable, "-c", AMPLIFIER, name, str(rate_hz), str(channels), *pauses]
        started.append(subprocess.Popen(command, stdout=subprocess.PIPE))
        assert started[-1].stdout.readline() == b"ready\n"

    yield start
    for process in started:
        process.kill()
        process.communicate()


def with_emg(**emg: object) -> Settings:
    return parse_settings({"emg": {"muscles": ["biceps", "triceps"], **emg}})


def recorded(
    settings: Settings,
    folder: Path,
    for_s: float,
    opened: Any = open_emg,
    session: Callable[[SessionMemory], None] = lambda _: None,
) -> tuple[float, list[str]]:
    """Run the EMG's process beside a session that lasts so long; return its origin and remarks."""
    shared = SessionMemory.create(1000.0, 10.0)
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    try:
        SessionWriter(folder, settings, [], {}, virtual=True).close(0.0, "success", "")
        shared.status.show_folder(folder)
        for role in (Role.LOOP, Role.RECORDER):
            shared.status.beat(role)
        arguments = (settings, opened, shared.names, 1000.0, os.getpid(), theirs)
        process = context.Process(target=emg_main, args=arguments)
        process.start()
        theirs.close()
        if refusal := ours.recv():  # empty once it is connected
            raise UserError(*refusal)
        origin_s = time.monotonic()
        shared.events.push(0, {"event": "clock_started", "monotonic_s": origin_s})
        session(shared)
        until_s = time.monotonic() + 60.0
        while time.monotonic() < until_s and process.is_alive():
            emg = read_emg(folder)
            if emg is not None and emg.time_s.size and emg.time_s[-1] - emg.time_s[0] > for_s:
                break
            time.sleep(0.1)
        shared.status.set_condition(Role.LOOP, ProcessCondition.DONE)
        process.join(30.0)
        assert process.exitcode == 0
        return origin_s, ours.recv()
    finally:
        shared.unlink()
        shared.close()


def reached(shared: SessionMemory, condition: ProcessCondition) -> str:
    """Wait until the process of the EMG shows this; return its note."""
    until_s = time.monotonic() + 30.0
    while shared.status.condition(Role.EMG) is not condition:
        assert time.monotonic() < until_s, shared.status.condition(Role.EMG)
        time.sleep(0.02)
    return shared.status.note(Role.EMG)


def test_what_a_stream_sends_is_recorded_on_the_clock_of_the_session(amplifier, tmp_path: Path):
    name = f"Amplifier{os.getpid()}"
    amplifier(name, 2000.0, 3, "pause")
    settings = with_emg(source="lsl", stream=name, unit="uV")
    require_emg(settings.emg)
    notes: list[str] = []

    def watch(shared: SessionMemory) -> None:
        notes.append(reached(shared, ProcessCondition.TROUBLE))
        reached(shared, ProcessCondition.RUNNING)

    origin_s, remarks = recorded(settings, tmp_path / "session", 3.0, session=watch)
    from_s = notes[0].removeprefix("missing since ").removesuffix(" s")
    assert remarks[0].startswith(f"EMG is missing from {from_s} to ")
    emg = read_emg(tmp_path / "session")
    assert list(emg.emg_v) == ["emg_v", "emg_2_v"]  # the third has no muscle
    assert emg.closed
    first, second = emg.emg_v.values()
    np.testing.assert_allclose(second - first, 1e-3)
    count = np.round(1e6 * first)
    steps = np.diff(count) % 1000
    at_gap = np.flatnonzero(np.diff(emg.time_s) > 0.1)
    assert at_gap.size == 1  # the outlet paused; nothing else is lost
    assert np.all(np.delete(steps, at_gap) == 1)
    assert np.diff(emg.time_s)[at_gap[0]] == pytest.approx(1.5, abs=0.2)
    assert any("EMG is missing from" in remark for remark in remarks)
    now_s = time.monotonic() - origin_s
    assert 0.0 <= emg.time_s[0] < 0.2
    assert emg.time_s[-1] < now_s
    assert now_s - emg.time_s[-1] < 20.0


def test_a_stream_that_is_slow_or_narrow_or_absent_is_refused(amplifier, monkeypatch):
    name = f"Slow{os.getpid()}"
    amplifier(name, 1000.0, 1)
    with pytest.raises(UserError, match="has 1000 Hz; EMG up to 450 Hz needs 2000 Hz or more"):
        require_emg(with_emg(source="lsl", stream=name).emg)
    monkeypatch.setattr("rigidimeter.rig.devices.emg_sources.FIND_S", 0.2)
    with pytest.raises(UserError, match="no stream of this name was found"):
        require_emg(with_emg(source="lsl", stream="Nobody").emg)


def vanished(_: EmgSettings) -> DaqEmg:
    raise RuntimeError("the outlet is gone")  # as pylsl raises it


def test_a_source_that_vanishes_while_it_is_connected_is_refused(tmp_path: Path):
    with pytest.raises(UserError, match="EMG was not recorded: the outlet is gone"):
        recorded(with_emg(source="lsl", stream="Gone"), tmp_path / "session", 1.0, vanished)


class Card:
    """A card that has so many samples at each read, and then none at all."""

    def __init__(self, reads: list[int]) -> None:
        self.reads, self.count, self.stopped = reads, 0, False

    def start(self) -> str:
        return "card"

    def read(self):
        if not self.reads:
            raise ReaderError("the buffer ran over")
        n = self.reads.pop(0)
        self.count += n
        return np.column_stack([np.arange(self.count - n, self.count)] * 2).astype(float)

    def stop(self) -> None:
        self.stopped = True


def broken_card(settings: EmgSettings) -> DaqEmg:
    return DaqEmg(settings, Card([100, 0, 250, 3]))


def test_a_card_that_fails_is_named_and_what_it_gave_is_kept(tmp_path: Path):
    settings = with_emg(source="daq", daq_channels="Dev2/ai0:1")
    source = DaqEmg(settings.emg, Card([100, 250]))
    before_s = time.monotonic()
    first, second = source.read(), source.read()
    np.testing.assert_array_equal(first.source_time_s, np.arange(100) / 2000.0)
    np.testing.assert_array_equal(second.source_time_s, np.arange(100, 350) / 2000.0)
    assert before_s <= first.source_time_s[-1] + first.monotonic_offset_s <= time.monotonic()
    notes: list[str] = []

    def watch(shared: SessionMemory) -> None:
        notes.append(reached(shared, ProcessCondition.FAILED))

    _, remarks = recorded(settings, tmp_path / "session", 1e9, broken_card, watch)
    assert remarks[-1] == f"EMG {notes[0]}"
    assert remarks[-1].startswith("EMG ended at")
    assert remarks[-1].endswith("the buffer ran over")
    assert read_emg(tmp_path / "session").closed


class Blocks:
    """A source whose samples come 0.8 s at a time, so many times."""

    rate_hz, block_s = 2000.0, 0.8

    def __init__(self, most: int) -> None:
        self.most, self.start_s, self.sent = most, time.monotonic() - self.block_s, 0

    def read(self) -> EmgSamples:
        due = min(int((time.monotonic() - self.start_s) / self.block_s), self.most)
        count = np.arange(self.sent, round(due * self.block_s * self.rate_hz))
        self.sent += count.size
        return EmgSamples(self.start_s + count / self.rate_hz, 0.0, np.zeros((count.size, 2)))

    def close(self) -> None:
        pass


def in_blocks(_: EmgSettings) -> Blocks:
    return Blocks(1000)


def in_three_blocks(_: EmgSettings) -> Blocks:
    return Blocks(3)


def test_a_source_that_sends_blocks_is_not_named_missing(tmp_path: Path):
    """Though they are longer than what else counts as missing; the last is waited for."""
    seen: set[ProcessCondition] = set()

    def watch(shared: SessionMemory) -> None:
        start_s = time.monotonic()
        while time.monotonic() < start_s + 3.0:
            seen.add(shared.status.condition(Role.EMG))
            time.sleep(0.02)
        shared.status.show_loop(LoopStatus(time_s=time.monotonic() - start_s))

    settings = with_emg(source="lsl", stream="Blocks")
    _, remarks = recorded(settings, tmp_path / "session", 0.5, in_blocks, watch)
    assert seen - {ProcessCondition.STARTING} == {ProcessCondition.RUNNING}
    assert remarks == []
    assert read_emg(tmp_path / "session").time_s[-1] > 3.0


def test_blocks_that_stop_are_named_missing(tmp_path: Path):
    notes: list[str] = []

    def watch(shared: SessionMemory) -> None:
        notes.append(reached(shared, ProcessCondition.TROUBLE))
        shared.status.show_loop(LoopStatus(time_s=10.0))

    settings = with_emg(source="lsl", stream="Blocks")
    _, remarks = recorded(settings, tmp_path / "session", 0.5, in_three_blocks, watch)
    since = notes[0].removeprefix("missing since ")
    assert remarks == [f"EMG is missing from {since.removesuffix(' s')} to 10.0 s"]


def test_the_virtual_subject_has_the_emg_of_its_ticks(tmp_path: Path):
    """Read from the ring as the ticks come, it is what the same ticks give at once."""
    settings = with_emg(source="virtual")
    subject = {"OFF": {"voluntary_sd_nm": 0.3}, "DBS": {"tremor_amplitude_nm": 0.2}}
    settings = parse_settings({"emg": settings.emg.model_dump(), "subject": subject})
    tick = np.delete(np.arange(3000), slice(700, 720))  # ticks that the loop missed
    epoch = np.select([tick < 500, tick < 1500, tick < 2000], [-1, 1, -1], 2)
    rows = [
        Sample(int(k), k / 1000.0, 0.0, int(n), *[0.0] * 9, 0)
        for k, n in zip(tick, epoch, strict=True)
    ]

    conditions = {1: "OFF", 2: "DBS"}
    shown: list[np.ndarray] = []

    def session(shared: SessionMemory) -> None:
        for k, row in enumerate(rows):
            if k and row.epoch > 0 and rows[k - 1].epoch != row.epoch:
                facts = {"epoch": row.epoch, "condition": conditions[row.epoch]}
                shared.events.push(k, {"event": "epoch_started", **facts})
            assert shared.samples.push(row)
            if k % 400 == 0:
                time.sleep(0.08)
        until_s = time.monotonic() + 30.0
        reader = EnvelopeReader(shared.status, 2)
        while not shown or shown[-1][-1, 0] < 2.92:
            assert time.monotonic() < until_s
            shown.append(reader.read())
            shown[:] = [points for points in shown if len(points)]
            time.sleep(0.02)

    _, remarks = recorded(settings, tmp_path / "session", 1.4, None, session)
    emg = read_emg(tmp_path / "session")
    before = settings.subject["OFF"].relaxed
    truth = VirtualMuscles(settings, before).take(tick, epoch, conditions)
    np.testing.assert_allclose(np.column_stack([*emg.emg_v.values()]), truth, atol=1e-15)
    np.testing.assert_allclose(emg.time_s, np.arange(len(truth)) / 2000.0, atol=1e-9)
    assert remarks == []
    points = np.vstack(shown)
    expected = LiveEnvelope(2000.0, 2).block(np.arange(len(truth)) / 2000.0, 1e6 * truth)
    np.testing.assert_allclose(points, expected[-len(points) :], atol=1e-9)
