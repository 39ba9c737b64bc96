"""An ATI force/torque transducer read as six voltages through an NI-DAQ card.

    load   = matrix · (V - bias)          (N and N·m; see `calibration`)
    torque = sign · weights · load        (N·m about the joint's axis)

The weights describe the mounting: Tz alone if the transducer's axis is the joint's, a lever arm in
m on a force if it is beside it. A transducer measures the load on its tool side. With the arm there
it measures what the arm applies to the drive, the opposite of what the drive applies to the joint,
so `sign` is -1 by default; mounted the other way round it is +1. Check it by hand, without power.
The voltages `bias_v` are those without a load; the weight of the arm is removed by the rig's
zeroing.

The card samples by its own clock into its own buffer, and `read` takes the buffered samples without
waiting. Saturation of any sample since the last read counts, not only of the newest. Noise changes
a working gauge at every sample, so six voltages that stay bit for bit the same mean a failure.
Values that are not finite are passed on; the guard handles them.

The reader is an argument, so that everything but `NiReader` runs without a card.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rigidimeter.core.settings import Section, quantity
from rigidimeter.rig.devices.ati.calibration import read_calibration
from rigidimeter.rig.devices.base import DeviceError, DeviceFacts, Now, TorqueSample
from rigidimeter.rig.guard import Cause

Six = Annotated[list[float], Field(min_length=6, max_length=6)]
BUFFER_S = 1.0


class ReaderError(Exception):
    """The card returned no voltages: an open wire, a task that ended, a buffer overflow."""


class VoltageReader(Protocol):
    """A source of voltages."""

    def start(self) -> str:
        """Start sampling; return the model of the card."""

    def read(self) -> NDArray[np.float64]:
        """Return the voltages since the last call, without waiting, shape (samples, inputs)."""

    def stop(self) -> None:
        """Stop sampling; safe when repeated."""


class AtiAnalogueSettings(Section):
    """Wiring and mounting of the transducer.

    Parameters
    ----------
    channels : str
        The card's channels in the order of the gauges, such as ``Dev1/ai0:5``.
    calibration : str
        Path of the transducer's ``*.cal`` file, or of a table in TOML.
    serial : str
        Serial number that the calibration must have; empty to accept any.
    """

    channels: str
    calibration: str
    serial: str = ""
    rate_hz: float = quantity(2000.0, "Hz", 10.0, 100_000.0)
    terminal: Literal["differential", "single-ended"] = "differential"
    range_v: float = quantity(10.0, "V", 0.1, 10.0)
    saturation_v: float = quantity(9.9, "V", 0.1, 10.0)
    frozen_s: float = quantity(0.05, "s", 0.001, 10.0)
    bias_v: Six = Field([0.0] * 6, json_schema_extra={"unit": "V"})
    weights: Six = Field(
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        json_schema_extra={"unit": "m for the forces, 1 for the torques"},
    )
    sign: Literal[1, -1] = -1

    @property
    def lock_names(self) -> tuple[str, ...]:
        """What the transducer is on, in whatever rig file."""
        return (f"NI-DAQ card {self.channels.partition('/')[0].lower()}",)


class AtiAnalogue:
    """A `TorqueSensor` that computes torque from six voltages.

    Parameters
    ----------
    settings : AtiAnalogueSettings
    now : callable
        Monotonic time in s.
    reader : VoltageReader, optional
        Replaces the card.
    """

    Settings: ClassVar[type[AtiAnalogueSettings]] = AtiAnalogueSettings

    def __init__(
        self, settings: AtiAnalogueSettings, now: Now, reader: VoltageReader | None = None
    ) -> None:
        self._settings = settings
        self._now = now
        self._given = reader
        self._reader: VoltageReader | None = None
        self._bias = np.array(settings.bias_v)
        self._row = np.zeros(6)
        self._sample = TorqueSample(math.nan, -math.inf)
        self._last: NDArray[np.float64] | None = None
        self._moved_s = 0.0
        self._sampling = False
        self._counts = dict.fromkeys(("received", "lost", "repeated", "reordered", "damaged"), 0)

    def connect(self) -> None:
        """Load the card's driver; nothing is sampled yet."""
        if self._reader is None:
            s = self._settings
            self._reader = (
                NiReader(s.channels, 6, s.rate_hz, s.terminal, s.range_v)
                if self._given is None
                else self._given
            )

    def configure(self) -> DeviceFacts:
        """Read the calibration and start sampling.

        Raises
        ------
        DeviceError
            If the calibration belongs to another transducer, or the card does not start.
        """
        s = self._settings
        if self._reader is None:
            raise DeviceError("torque sensor: configure before connect; call connect first")
        if s.saturation_v >= s.range_v:
            raise DeviceError(
                f"torque sensor: saturation_v = {s.saturation_v:g} is never reached in a range of "
                f"±{s.range_v:g} V; it must be less than range_v"
            )
        calibration = read_calibration(Path(s.calibration))
        if s.serial and calibration.serial != s.serial:
            raise DeviceError(
                f"torque sensor: {s.calibration} is the calibration of "
                f"{calibration.serial or 'no named sensor'}; expected that of {s.serial}"
            )
        # The joint torque per volt of each gauge, in N·m/V.
        self._row = np.asarray(s.sign * (np.array(s.weights) @ calibration.matrix))
        try:
            card = self._reader.start()
        except (ReaderError, OSError) as error:
            raise DeviceError(f"torque sensor: {s.channels} does not start: {error}") from error
        self._sampling = True
        self._last = None
        self._sample = TorqueSample(math.nan, -math.inf)
        return DeviceFacts(
            model=calibration.model,
            serial=calibration.serial,
            fastest_tick_rate_hz=s.rate_hz,
            values={
                "card": card,
                "channels": s.channels,
                "rate_hz": s.rate_hz,
                "force_unit": calibration.force_unit,
                "torque_unit": calibration.torque_unit,
                "torque_per_volt": " ".join(f"{value:.9g}" for value in self._row),
                "bias_v": " ".join(f"{value:.9g}" for value in s.bias_v),
            },
        )

    def read(self) -> TorqueSample:
        """Return the newest sample without waiting; the previous one if there is no new one."""
        if not self._sampling or self._reader is None:
            return self._sample
        now_s = self._now()
        try:
            volts = self._reader.read()
        except (ReaderError, OSError):
            self._counts["damaged"] += 1
            self._sample = self._sample._replace(cause=int(Cause.TORQUE_STATUS))
            return self._sample
        if len(volts) == 0:
            return self._sample
        newest = volts[-1]
        self._counts["received"] += len(volts)
        self._counts["repeated"] += self._note_frozen(volts, now_s)
        cause = Cause.NONE
        if now_s - self._moved_s >= self._settings.frozen_s:
            cause = Cause.TORQUE_FROZEN
        # Saturation comes first: a saturated gauge does not change either.
        if (np.abs(volts) >= self._settings.saturation_v).any():
            cause = Cause.TORQUE_SATURATED
        self._sample = TorqueSample(
            float(self._row @ (newest - self._bias)),
            now_s,
            self._sample.sequence + len(volts),
            tuple(round(1e6 * v) if np.isfinite(v) else 0 for v in newest.tolist()),
            0,
            int(cause),
        )
        return self._sample

    @property
    def counts(self) -> Mapping[str, int]:
        """Samples received, samples repeated bit for bit, and reads that failed (``damaged``)."""
        return dict(self._counts)

    def close(self) -> None:
        """Stop sampling."""
        self._sampling = False
        reader, self._reader = self._reader, None
        if reader is not None:
            reader.stop()

    def _note_frozen(self, volts: NDArray[np.float64], now_s: float) -> int:
        """Note when the voltages last changed; return how many samples repeat the previous one."""
        before = volts[:1] if self._last is None else self._last[None]
        # Compared as bits, so that a NaN equals a NaN.
        bits = np.ascontiguousarray(np.vstack((before, volts))).view(np.int64)
        same = (bits[1:] == bits[:-1]).all(axis=1)
        if self._last is None or not same.all():
            self._moved_s = now_s
        first, self._last = self._last is None, volts[-1].copy()
        return int(same.sum()) - int(first)


class NiReader:
    """Voltages from an NI-DAQ card, sampled by its own clock.

    This has never run with a card. The calls follow the public reference of `nidaqmx`; verify at
    commissioning that `read` returns at once and that an unplugged connector is detected.

    Parameters
    ----------
    channels : str
        The card's inputs, such as ``Dev1/ai0:5``.
    inputs : int
        How many they are.
    rate_hz : float
    terminal : {"differential", "single-ended"}
    range_v : float
    """

    def __init__(
        self, channels: str, inputs: int, rate_hz: float, terminal: str, range_v: float
    ) -> None:
        try:
            import nidaqmx
        except ImportError as error:
            raise DeviceError(
                "voltages of an NI card need nidaqmx: pip install 'rigidimeter[nidaq]'"
            ) from error
        self._nidaqmx: Any = nidaqmx
        self._channels, self._inputs, self._rate_hz = channels, inputs, rate_hz
        self._terminal, self._range_v = terminal, range_v
        self._task: Any = None

    def start(self) -> str:
        """Start a continuous task of all inputs."""
        ni = self._nidaqmx

        def begin() -> str:
            constants = ni.constants
            self._task = ni.Task()
            channels = self._task.ai_channels.add_ai_voltage_chan(
                self._channels,
                terminal_config=constants.TerminalConfiguration.DIFF
                if self._terminal == "differential"
                else constants.TerminalConfiguration.RSE,
                min_val=-self._range_v,
                max_val=self._range_v,
            )
            found = len(channels.channel_names)
            if found != self._inputs:
                raise ReaderError(f"{self._channels} is {found} inputs; {self._inputs} are needed")
            self._task.timing.cfg_samp_clk_timing(
                self._rate_hz,
                sample_mode=constants.AcquisitionType.CONTINUOUS,
                samps_per_chan=round(BUFFER_S * self._rate_hz),
            )
            self._task.start()
            return str(self._task.devices[0].product_type)

        return str(self._tried(begin))

    def read(self) -> NDArray[np.float64]:
        """Return what the card has sampled since the last call."""

        def take() -> NDArray[np.float64]:
            ready = self._task.in_stream.avail_samp_per_chan
            if ready == 0:
                return np.empty((0, self._inputs))
            columns = self._task.read(number_of_samples_per_channel=ready, timeout=0.0)
            return np.asarray(columns, dtype=np.float64).reshape(self._inputs, ready).T

        return np.asarray(self._tried(take))

    def stop(self) -> None:
        """End the task."""
        task, self._task = self._task, None
        if task is not None:
            task.close()

    def _tried(self, action: Callable[[], Any]) -> Any:
        try:
            return action()
        except self._nidaqmx.errors.Error as error:
            raise ReaderError(str(error)) from error
