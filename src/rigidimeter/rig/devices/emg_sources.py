"""Where EMG comes from: a stream of Lab Streaming Layer, or an NI-DAQ card.

A source has a clock of its own. It gives stamps on it, and what is to be added for CLOCK_MONOTONIC
of this computer, measured while it runs. It is read in a process of its own: its calls may wait.
"""

from __future__ import annotations

import importlib.util
import time
from contextlib import suppress
from typing import Any

import numpy as np

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import LEAST_RATE_HZ, EmgSettings
from rigidimeter.rig.devices.ati.analogue import NiReader, ReaderError, VoltageReader
from rigidimeter.rig.devices.ati.sample_clock import SampleClock
from rigidimeter.rig.devices.base import DeviceError, EmgSamples, EmgSource

FIND_S = 5.0
"""For how long a stream is looked for before a session."""
OFFSET_EVERY_S = 5.0
BUFFER_S = 360
"""So much of a stream waits in memory while its process cannot take it."""
_DRIFT = 1e-4
"""Two clocks of computers and cards part by less, in s/s."""
_IN_VOLTS = {"V": 1.0, "mV": 1e-3, "uV": 1e-6}


def require_emg(settings: EmgSettings) -> None:
    """Refuse a source that is not there or too slow, before anything moves.

    Raises
    ------
    UserError
        With what would be right.
    """
    package, extra = {"lsl": ("pylsl", "lsl"), "daq": ("nidaqmx", "nidaq")}.get(
        settings.source, ("", "")
    )
    if package and importlib.util.find_spec(package) is None:
        raise UserError(
            f'emg.source = "{settings.source}" needs one more package: '
            f"pip install 'rigidimeter[{extra}]'"
        )
    if settings.source == "lsl":
        _found(settings)


def open_emg(settings: EmgSettings) -> EmgSource:
    """Connect to the source of these settings, a stream or a card.

    Raises
    ------
    UserError
        As `require_emg`.
    """
    return LslEmg(settings) if settings.source == "lsl" else DaqEmg(settings)


def _found(settings: EmgSettings) -> Any:
    """Return what the stream says of itself."""
    from pylsl import resolve_byprop

    streams = resolve_byprop("name", settings.stream, 1, FIND_S)
    said = f"emg.stream = {settings.stream!r}"
    if not streams:
        raise UserError(
            f"{said}: no stream of this name was found in {FIND_S:g} s; start the amplifier's "
            "program, and compare the name with that in its settings"
        )
    info = streams[0]
    rate_hz, channels = info.nominal_srate(), info.channel_count()
    if rate_hz < LEAST_RATE_HZ:
        rate = f"{rate_hz:g} Hz" if rate_hz else "no regular rate"
        raise UserError(
            f"{said} has {rate}; EMG up to 450 Hz needs {LEAST_RATE_HZ:g} Hz or more, which is "
            "set in the amplifier's program"
        )
    if channels < len(settings.muscles):
        raise UserError(
            f"{said} has {channels} channels, but emg.muscles names {len(settings.muscles)}; name "
            "one for each channel"
        )
    return info


class LslEmg:
    """The first channels of a stream of Lab Streaming Layer; the clock is that of its sender.

    A stream that breaks off is waited for; it goes on where its sender does.

    Parameters
    ----------
    settings : EmgSettings
    """

    def __init__(self, settings: EmgSettings) -> None:
        from pylsl import StreamInlet, local_clock

        self._muscles, self._scale = len(settings.muscles), _IN_VOLTS[settings.unit]
        info = _found(settings)
        self.rate_hz, self._channels = float(info.nominal_srate()), info.channel_count()
        self._inlet = StreamInlet(info, max_buflen=BUFFER_S)
        self._inlet.open_stream(FIND_S)
        self._local_ahead_s = local_clock() - time.monotonic()
        self._offset_s = -self._local_ahead_s
        self._measured_s = -np.inf

    def read(self) -> EmgSamples:
        """Return the samples since the last call, stamps as they were sent."""
        values, stamps = self._inlet.pull_chunk(timeout=0.0, max_samples=65536)
        emg_v = np.asarray(values, dtype=np.float64).reshape(len(stamps), self._channels)
        if stamps and time.monotonic() - self._measured_s > OFFSET_EVERY_S:
            self._measure()
        return EmgSamples(
            np.asarray(stamps), self._offset_s, self._scale * emg_v[:, : self._muscles]
        )

    def _measure(self) -> None:
        """Measure the clock's offset; a sender that does not answer leaves the one before."""
        from pylsl.util import LostError
        from pylsl.util import TimeoutError as NoAnswer

        self._measured_s = time.monotonic()
        with suppress(LostError, NoAnswer):
            self._offset_s = self._inlet.time_correction(1.0) - self._local_ahead_s

    def close(self) -> None:
        """Leave the stream."""
        self._inlet.close_stream()


class DaqEmg:
    """Inputs of an NI-DAQ card; its clock is the count of its samples.

    Parameters
    ----------
    settings : EmgSettings
    reader : VoltageReader, optional
        Replaces the card.
    """

    def __init__(self, settings: EmgSettings, reader: VoltageReader | None = None) -> None:
        self.rate_hz = settings.rate_hz
        self._clock = SampleClock(_DRIFT)
        self._clock.restart(settings.rate_hz)
        self._count, self._offset_s = 0, 0.0
        self._reader = reader or NiReader(
            settings.daq_channels,
            len(settings.muscles),
            settings.rate_hz,
            settings.daq_terminal,
            settings.daq_range_v,
        )
        try:
            self._reader.start()
        except ReaderError as error:
            raise DeviceError(f"EMG: {settings.daq_channels} does not start: {error}") from error

    def read(self) -> EmgSamples:
        """Return the samples since the last call.

        Raises
        ------
        DeviceError
            If the card gives none: a task that ended, an overflow of its buffer.
        """
        try:
            emg_v = self._reader.read()
        except ReaderError as error:
            raise DeviceError(f"EMG card: {error}") from error
        n = len(emg_v)
        source_s = (self._count + np.arange(n)) / self.rate_hz
        self._count += n
        if n:
            taken_s = self._clock.taken_s(time.monotonic(), n)
            self._offset_s = taken_s - float(source_s[-1])
        return EmgSamples(source_s, self._offset_s, emg_v)

    def close(self) -> None:
        """End the card's task."""
        self._reader.stop()
