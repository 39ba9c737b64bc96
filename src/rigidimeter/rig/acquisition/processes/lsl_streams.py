"""The streaming process: what is recorded, sent as streams of Lab Streaming Layer.

It reads the ring behind the recorder, so that what is sent is in the file, about 0.1 s after it was
measured. The loop does nothing for it and never waits for it; nor does the recorder. Where it falls
behind, samples are missing in the stream and in nothing else.

Each stamp is that of the tick, on the clock that Lab Streaming Layer uses on this machine.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.files import json_text
from rigidimeter.core.session import SAMPLE_UNITS, marker_of, read_manifest, sample_markers
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.core.version import __version__
from rigidimeter.rig.acquisition.processes.end_signals import leave_to_the_others
from rigidimeter.rig.acquisition.processes.ring import ROW, SampleReader
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.status_values import Role
from rigidimeter.rig.guard import Cause

if TYPE_CHECKING:
    from pylsl import StreamInfo, StreamOutlet

POLL_S = 0.05
LINGER_S = 0.5
"""How long the streams stay after the session, so that all is fetched."""
NICENESS = 5
SAMPLES_TYPE, MARKERS_TYPE = "RobotSamples", "Markers"

_CAUSES = {int(cause): cause.name.lower() for cause in Cause}
_COLUMNS = tuple(ROW.names or ())


class Streams:
    """The two outlets of a session.

    Parameters
    ----------
    settings : Settings
    session_id : str
    virtual : bool
    """

    def __init__(self, settings: Settings, session_id: str, virtual: bool) -> None:
        from pylsl import StreamOutlet, local_clock

        self._conditions = settings.sharing.lsl_conditions
        samples, markers = stream_infos(settings, session_id, virtual)
        self._samples: StreamOutlet = StreamOutlet(samples)
        self._markers: StreamOutlet = StreamOutlet(markers)
        self._clock = local_clock
        self._monotonic_ahead_s = local_clock() - time.monotonic()
        self._origin_s: float | None = None
        self._before = (0, 0)

    def start(self, monotonic_s: float) -> None:
        """Take when the session began on CLOCK_MONOTONIC."""
        self._origin_s = monotonic_s + self._monotonic_ahead_s

    def samples(self, rows: NDArray[np.void]) -> None:
        """Send rows of the ring, and markers of what the guard did in them."""
        if not rows.size:
            return
        if self._origin_s is None:  # the loop did not say when it began
            self._origin_s = self._clock() - float(rows["time_s"][-1])
        stamps = rows["time_s"] + self._origin_s
        values = np.column_stack([rows[name].astype(np.float64) for name in _COLUMNS])
        self._samples.push_chunk(values, stamps.tolist())
        found = sample_markers(rows["limited"], rows["cause"], self._before, _CAUSES)
        for row, text in found:
            self._markers.push_sample([text], float(stamps[row]))
        self._before = int(rows["limited"][-1]), int(rows["cause"][-1])

    def event(self, facts: Mapping[str, Any]) -> None:
        """Send an event as a marker, at its time where it has one."""
        if facts.get("event") == "clock_started":
            self.start(float(facts["monotonic_s"]))
            return
        if not self._conditions and "condition" in facts:
            facts = {**facts, "condition": ""}
        time_s = facts.get("time_s")
        at_s = self._clock()
        if self._origin_s is not None and isinstance(time_s, int | float):
            at_s = self._origin_s + time_s
        self._markers.push_sample([marker_of(facts)], at_s)


def stream_infos(
    settings: Settings, session_id: str, virtual: bool
) -> tuple[StreamInfo, StreamInfo]:
    """Return what the streams of samples and of markers say of themselves.

    The source id is that of rig and computer: who receives a stream finds it again after a restart.
    """
    from pylsl import StreamInfo

    name = settings.sharing.lsl_name
    source = f"rigidimeter-{socket.gethostname()}-{name}"
    rate_hz = settings.rig.tick_rate_hz
    samples = StreamInfo(name, SAMPLES_TYPE, len(_COLUMNS), rate_hz, "double64", source)
    channels = samples.desc().append_child("channels")
    for column in _COLUMNS:
        channel = channels.append_child("channel")
        channel.append_child_value("label", column)
        channel.append_child_value("unit", SAMPLE_UNITS[column])
    markers = StreamInfo(f"{name}Markers", MARKERS_TYPE, 1, 0.0, "string", f"{source}-markers")
    dumped = dump_settings(settings)
    if not settings.sharing.lsl_conditions:  # both name conditions
        del dumped["protocol"], dumped["subject"]
    for info in (samples, markers):
        about = info.desc().append_child("rigidimeter")
        about.append_child_value("version", __version__)
        about.append_child_value("session_id", session_id)
        about.append_child_value("virtual", str(virtual).lower())
        about.append_child_value("settings", json_text(dumped))
    return samples, markers


def streamer_main(
    settings: Settings, names: tuple[str, str, str], lost_s: float, console_pid: int
) -> None:
    """Send until all that was recorded is sent; the target of the streaming process.

    Parameters
    ----------
    settings : Settings
    names : tuple of str
        Of the sample ring, the event ring and the shared status.
    lost_s : float
        Recorder and loop both silent for so long have ended.
    console_pid : int
        The process that started this one.
    """
    leave_to_the_others()
    os.nice(NICENESS)
    shared = SessionMemory.attach_or_end(names)
    try:
        folder = shared.status.folder()
        manifest = read_manifest(folder) if folder is not None else {}
        streams = Streams(
            settings, str(manifest.get("session_id", "")), bool(manifest.get("virtual"))
        )
        reader, sent_events, over = SampleReader(shared.samples), 0, False
        while not over:
            over = os.getppid() != console_pid or shared.status.ended(Role.RECORDER, lost_s)
            recorded_events = shared.events.recorded
            rows, _ = reader.read(recorded=True)
            # Events that are still in their ring.
            first = max(sent_events, recorded_events - shared.events.capacity // 2)
            for number in range(first, recorded_events):
                streams.event(shared.events.get(number).facts)
            sent_events = recorded_events
            streams.samples(rows)
            if not over:
                time.sleep(POLL_S)
        time.sleep(LINGER_S)
    finally:
        shared.leave()
