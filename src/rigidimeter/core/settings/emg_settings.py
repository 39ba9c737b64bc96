"""Settings of the EMG that `run` records beside torque and motion."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from rigidimeter.core.records import EMG_CHANNELS
from rigidimeter.core.settings.section import Section, quantity

LEAST_RATE_HZ = 2000.0
"""More than four times the 450 Hz up to which surface EMG reaches."""


class EmgSettings(Section):
    """Muscles whose EMG is recorded, raw, and where it comes from.

    Parameters
    ----------
    source : {"none", "lsl", "daq", "virtual"}
        ``virtual`` is that of the virtual subject, from its own torque. On the simulated clock of
        `simulate` every source but ``none`` is.
    stream : str
        Name of the stream of Lab Streaming Layer.
    unit : {"V", "mV", "uV"}
        Of the numbers in that stream; volts are stored.
    daq_channels : str
        Channels of an NI-DAQ card, one for each muscle, such as ``Dev2/ai0:1``.
    muscles : list of str
        One label for each channel, in the order of the source.
    electrodes, placement : str
        Kind, size and distance of the electrodes, and where they are, as SENIAM asks to report.
    rate_hz : float
        Of the DAQ card and of the virtual subject; a stream has its own, at least 2000 Hz.
    virtual_uv_per_nm, virtual_noise_uv, virtual_hum_uv : float
        Of the virtual subject: RMS for each N·m of its own torque in the direction of the muscle,
        RMS of the baseline noise, amplitude of the 50 Hz hum. Odd muscles drive the joint toward
        positive angles, even ones toward negative.
    virtual_delay_s : float
        Of the virtual subject: from a muscle's EMG to its torque, 0.05 s at the elbow (Cavanagh and
        Komi 1979).
    """

    source: Literal["none", "lsl", "daq", "virtual"] = "none"
    stream: str = Field("", max_length=60)
    unit: Literal["V", "mV", "uV"] = "V"
    daq_channels: str = Field("", max_length=100)
    daq_terminal: Literal["differential", "single-ended"] = "differential"
    daq_range_v: float = quantity(10.0, "V", 0.1, 10.0)
    muscles: list[str] = Field(default_factory=list, max_length=len(EMG_CHANNELS))
    electrodes: str = Field("", max_length=400)
    placement: str = Field("", max_length=400)
    rate_hz: float = quantity(LEAST_RATE_HZ, "Hz", LEAST_RATE_HZ, 50000.0)
    virtual_uv_per_nm: float = quantity(200.0, "µV/(N·m)", 0.0, 100000.0)
    virtual_noise_uv: float = quantity(4.0, "µV", 0.0, 10000.0)
    virtual_hum_uv: float = quantity(2.0, "µV", 0.0, 10000.0)
    virtual_delay_s: float = quantity(0.05, "s", 0.0, 0.2)

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.source == "none":
            return self
        if not self.muscles or not all(self.muscles):
            raise ValueError(
                f'muscles must have a label for each channel where source = "{self.source}", such '
                'as muscles = ["biceps", "triceps"]'
            )
        if self.source == "lsl" and not self.stream:
            raise ValueError('stream must name the stream where source = "lsl"')
        if self.source == "daq" and not self.daq_channels:
            raise ValueError('daq_channels must name the inputs where source = "daq"')
        return self

    @property
    def channels(self) -> tuple[str, ...]:
        """Name of each channel: ``emg_v``, ``emg_2_v`` and so on."""
        if self.source == "none":
            return ()
        return EMG_CHANNELS[: len(self.muscles)]
