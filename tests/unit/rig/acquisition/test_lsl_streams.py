"""What other programs receive by Lab Streaming Layer is what is recorded, to the last bit."""

from __future__ import annotations

import json
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from rigidimeter.core.session import Sample, SessionWriter, marker_of, read_manifest, sample_markers
from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.acquisition.processes import (
    ProcessCondition,
    Role,
    SessionMemory,
    streamer_main,
)
from rigidimeter.rig.guard import Cause

RATE_HZ = 250.0
CONFIG = """\
[ports]
IPv6 = disable
[multicast]
ResolveScope = machine
[lab]
KnownPeers = {127.0.0.1}
"""
GIVE_UP_S = 60.0


def sample(k: int, rng: np.random.Generator, limited: int, cause: int) -> Sample:
    floats = rng.normal(size=10)
    return Sample(
        k, k / RATE_HZ, *floats[:1], 1, *floats[1:9], float("nan"), limited, k, 7, -1, 0, cause
    )


@pytest.fixture
def shared(tmp_path: Path, monkeypatch) -> Iterator[SessionMemory]:
    """Return the memory of a session whose recorder has made its folder."""
    pytest.importorskip("pylsl", reason="pip install 'rigidimeter[lsl]'")
    (tmp_path / "lsl.cfg").write_text(CONFIG)
    monkeypatch.setenv("LSLAPICFG", str(tmp_path / "lsl.cfg"))
    memory = SessionMemory.create(RATE_HZ, 60.0)
    yield memory
    memory.unlink()
    memory.close()


def streaming(
    shared: SessionMemory, folder: Path, **sharing: object
) -> multiprocessing.process.BaseProcess:
    """Start the streaming process of a session."""
    settings = parse_settings(
        {"rig": {"tick_rate_hz": RATE_HZ, "torque": {"rate_hz": RATE_HZ},
                 "motion": {"rate_hz": RATE_HZ}}, "sharing": {"lsl": True, **sharing}}
    )  # fmt: skip
    SessionWriter(folder, settings, [], {}, virtual=True).close(0.0, "success", "")
    shared.status.show_folder(folder)
    for role in (Role.LOOP, Role.RECORDER):
        shared.status.beat(role)
    process = multiprocessing.get_context("spawn").Process(
        target=streamer_main, args=(settings, shared.names, 1000.0, os.getpid())
    )
    process.start()
    return process


def inlets(name: str):
    """Return inlets of the streams of samples and of markers, connected."""
    import pylsl

    found = []
    for wanted in (name, f"{name}Markers"):
        (info, *_) = pylsl.resolve_byprop("name", wanted, 1, GIVE_UP_S)
        inlet = pylsl.StreamInlet(info)
        inlet.open_stream(GIVE_UP_S)
        found.append(inlet)
    return found


def pulled(inlet, enough: Callable[[int], bool]) -> tuple[list, list[float]]:
    values, stamps = [], []
    until_s = time.monotonic() + GIVE_UP_S
    while not enough(len(stamps)) and time.monotonic() < until_s:
        more, at_s = inlet.pull_chunk(timeout=0.2)
        values += list(more)
        stamps += at_s
    return values, stamps


def test_an_inlet_receives_what_is_recorded(shared: SessionMemory, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    guarded = {200: (2, 0), 201: (2, 0), 300: (4, 1), 301: (4, 1)}
    rows = [sample(k, rng, *guarded.get(k, (0, 0))) for k in range(400)]
    name = f"Robot{os.getpid()}"
    process = streaming(shared, tmp_path / "session", lsl_name=name)
    try:
        samples, markers = inlets(name)
        origin_s = time.monotonic()
        started = {"event": "epoch_started", "epoch": 1, "label": "1", "task": "prbs",
                   "condition": "DBS", "time_s": 0.0}  # fmt: skip
        shared.events.push(0, {"event": "clock_started", "monotonic_s": origin_s})
        shared.events.push(0, started)
        shared.events.recorded = 2
        for first in range(0, len(rows), 25):
            for row in rows[first : first + 25]:
                assert shared.samples.push(row)
            # What is not in the file yet is not sent.
            shared.samples.recorded = min(first + 25, 375)
        values, stamps = pulled(samples, lambda n: n >= 375)
        assert len(stamps) == 375
        shared.samples.recorded = 400
        more, later = pulled(samples, lambda n: n >= 25)
        texts, at_s = pulled(markers, lambda n: n >= 4)
        info = samples.info()
    finally:
        shared.status.set_condition(Role.RECORDER, ProcessCondition.DONE)
        process.join(GIVE_UP_S)
    assert process.exitcode == 0
    np.testing.assert_array_equal(np.array(values + more), np.array(rows, dtype=float))
    expected = origin_s + np.arange(400) / RATE_HZ
    import pylsl

    ahead_s = pylsl.local_clock() - time.monotonic()
    np.testing.assert_allclose(np.array(stamps + later) - ahead_s, expected, atol=1e-3)
    assert [text for (text,) in texts] == [
        "epoch_start/1/prbs/DBS",
        "limit/speed",
        "limit/latched",
        f"stop/{Cause(1).name.lower()}",
    ]
    np.testing.assert_allclose(np.array(at_s) - ahead_s - origin_s, [0, 0.8, 1.2, 1.2], atol=1e-3)
    assert info.source_id().startswith("rigidimeter-")
    root = info.desc()
    channel = root.child("channels").child("channel")
    labels = []
    while not channel.empty():
        labels.append(channel.child_value("label"))
        channel = channel.next_sibling("channel")
    assert tuple(labels) == Sample._fields
    about = root.child("rigidimeter")
    assert about.child_value("session_id") == read_manifest(tmp_path / "session")["session_id"]
    assert about.child_value("virtual") == "true"
    assert json.loads(about.child_value("settings"))["rig"]["tick_rate_hz"] == RATE_HZ


def test_conditions_stay_out_where_they_must(shared: SessionMemory, tmp_path: Path) -> None:
    name = f"Blinded{os.getpid()}"
    process = streaming(shared, tmp_path / "session", lsl_name=name, lsl_conditions=False)
    try:
        _, markers = inlets(name)
        started = {"event": "epoch_started", "label": "1", "task": "prbs", "condition": "DBS"}
        shared.events.push(0, started)
        shared.events.recorded = 1
        texts, _ = pulled(markers, lambda n: n >= 1)
        text = markers.info().as_xml()
    finally:
        shared.status.set_condition(Role.RECORDER, ProcessCondition.DONE)
        process.join(GIVE_UP_S)
    assert texts == [["epoch_start/1/prbs/"]]
    assert "DBS" not in text
    assert "OFF" not in text


def test_markers_of_what_the_guard_did() -> None:
    limited = np.array([2, 2, 0, 3, 4, 4])
    cause = np.array([0, 0, 0, 0, 5, 5])
    found = sample_markers(limited, cause, (2, 0), {5: "stale"})
    assert found == [(3, "limit/position"), (4, "limit/latched"), (4, "stop/stale")]


def test_a_marker_has_no_more_words_than_it_should() -> None:
    event = {"event": "epoch_started", "label": "a/b", "task": "prbs", "condition": ""}
    assert marker_of(event) == "epoch_start/a b/prbs/"
    assert marker_of({"event": "sensor_zeroed", "bias_nm": 1.0}) == "sensor_zeroed"
