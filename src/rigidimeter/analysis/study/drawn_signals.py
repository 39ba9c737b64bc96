"""What figures and traces show of the samples of a study, as values without the samples."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.records import Channel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ChannelFacts:
    """What tables say of a channel of an epoch.

    Attributes
    ----------
    name : str
    rate_hz, mean_rate_hz : float
        As `Channel` has them.
    span_s : float
        From the first sample to the last; NaN without one.
    lowest, highest : float
        Of its finite samples, in its unit; NaN without one.
    """

    name: str
    rate_hz: float
    mean_rate_hz: float
    span_s: float
    lowest: float = math.nan
    highest: float = math.nan


def facts_of(channel: Channel) -> ChannelFacts:
    """Return what tables say of a channel."""
    span_s = float(channel.time_s[-1] - channel.time_s[0]) if len(channel) else float("nan")
    finite = channel.values[np.isfinite(channel.values)]
    ends = (float(finite.min()), float(finite.max())) if finite.size else (math.nan, math.nan)
    return ChannelFacts(channel.name, channel.rate_hz, channel.mean_rate_hz, span_s, *ends)


@dataclass(frozen=True)
class Response:
    """The measured impedance of one condition at the lines of the perturbation.

    Attributes
    ----------
    frequency_hz, coherence : arrays, shape (m,)
    impedance_nm_rad : array of complex, shape (m,)
    observed, included : int
        Epochs that it is made of, and epochs of the condition that count.
    """

    frequency_hz: Array
    impedance_nm_rad: NDArray[np.complex128]
    coherence: Array
    observed: int
    included: int


@dataclass(frozen=True)
class Spectrum:
    """The torque of one epoch that J, B and K do not explain.

    Attributes
    ----------
    condition : str
    frequency_hz, density : arrays, shape (n,)
        One-sided power spectral density in (N·m)²/Hz, within the band of the epoch.
    sd_nm : float
    band_hz : (float, float)
    """

    condition: str
    frequency_hz: Array
    density: Array
    sd_nm: float
    band_hz: tuple[float, float]


@dataclass(frozen=True)
class EpochTrace:
    """The traces of an epoch: each a unit and 16-bit numbers in base64, little-endian.

    Attributes
    ----------
    source, epoch : str
    start_s : float
        Of the first point, from the start of the epoch.
    step_s : float
    shown_s, length_s : float
        How much is shown, of how much.
    series : mapping of str to (float, str)
        ``torque``, ``angle`` and of a fit ``residual``.
    active : tuple of (float, float)
        From when to when a muscle was active, in s from the start of the epoch.
    """

    source: str
    epoch: str
    start_s: float
    step_s: float
    shown_s: float
    length_s: float
    series: Mapping[str, tuple[float, str]]
    active: tuple[tuple[float, float], ...] = ()
