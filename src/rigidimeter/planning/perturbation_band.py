"""What the perturbation excites (Fig. 3b), held against the band that the estimation wants.

A periodic sequence of N = 2ⁿ − 1 chips at f_clock has lines at whole multiples of f_clock / N.
Spread over that spacing, the line at f carries the density

    S(f) = 2 A² (N + 1) / (N f_clock) · sinc²(f / f_clock)      (one-sided, N²m²/Hz)

that is, a plateau that the hold of each chip rolls off: −3 dB at 0.443 f_clock, nothing at f_clock.

The paper calls 0.15–10 Hz the effective band of its sequence (Sec. 2.4.3) and prints neither clock
nor length. Seven bits at 20 Hz fit: the first line is at 0.1575 Hz and the envelope at 10 Hz is
3.92 dB down.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rigidimeter.core.records import readonly
from rigidimeter.core.settings import PrbsSettings
from rigidimeter.planning.perturbations import chip_count, prbs_nm, prbs_period_s

DROP_DB = 6.0
"""How far below its plateau the perturbation may be at an edge of the wanted band."""

HALF_POWER_DB = 10.0 * math.log10(2.0)
"""What "−3 dB" means here and in `JointDynamics.bandwidth_hz`: half the power."""

_NOTHING_DB = -120.0
_ROUNDING = 1e-9


@dataclass(frozen=True)
class TorqueSpectrum:
    """One-sided power spectral density of a torque.

    Parameters
    ----------
    frequency_hz : array, shape (m,)
        From 0, evenly spaced.
    density_n2m2_hz : array, shape (m,)
        In N²m²/Hz; its sum times the spacing is the variance.
    """

    frequency_hz: NDArray[np.float64]
    density_n2m2_hz: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "frequency_hz", readonly(self.frequency_hz))
        object.__setattr__(self, "density_n2m2_hz", readonly(self.density_n2m2_hz))

    def share(self, low_hz: float, high_hz: float) -> float:
        """Return the part of the variance between two frequencies, both included, 0 to 1.

        Raises
        ------
        ValueError
            If there is no variance at all.
        """
        total = float(np.sum(self.density_n2m2_hz))
        if total <= 0:
            raise ValueError("a torque that never changes has no power to share out")
        inside = (self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz)
        return float(np.sum(self.density_n2m2_hz[inside])) / total


def line_spacing_hz(settings: PrbsSettings) -> float:
    """Return the spacing of the lines, which is also the lowest: f_clock / (2ⁿ − 1), in Hz."""
    return settings.clock_hz / chip_count(settings)


def plateau_n2m2_hz(settings: PrbsSettings) -> float:
    """Return the density that the envelope approaches at low frequency, in N²m²/Hz.

    2 A² (N + 1) / (N f_clock), with A the amplitude and N = 2ⁿ − 1.
    """
    chips = chip_count(settings)
    return 2.0 * settings.amplitude_nm**2 * (chips + 1) / (chips * settings.clock_hz)


def envelope_db(frequency_hz: ArrayLike, clock_hz: float) -> NDArray[np.float64]:
    """Return sinc²(f / f_clock) in dB: the envelope relative to its plateau.

    Nulls, and anything as low, are given as −120 dB.
    """
    power = np.sinc(np.asarray(frequency_hz, dtype=np.float64) / clock_hz) ** 2
    return np.asarray(10.0 * np.log10(np.maximum(power, 10.0 ** (_NOTHING_DB / 10.0))))


def envelope_edge_hz(clock_hz: float, drop_db: float = HALF_POWER_DB) -> float:
    """Return where sinc²(f / f_clock) first falls `drop_db` below its plateau, in Hz.

    Solved numerically inside the main lobe, where the envelope falls all the way: 0.4429 f_clock
    for half the power, 0.6028 f_clock for 6 dB.

    Raises
    ------
    ValueError
        If `drop_db` is not above 0 and at most 100 dB.
    """
    if not 0 < drop_db <= 100:
        raise ValueError(f"drop_db must be above 0 and at most 100 dB, got {drop_db}")
    wanted = 10.0 ** (-drop_db / 20.0)
    ratio = scipy.optimize.brentq(lambda x: float(np.sinc(x)) - wanted, 0.0, 1.0, xtol=1e-14)
    return float(ratio) * clock_hz


def power_spectrum(torque_nm: ArrayLike, rate_hz: float) -> TorqueSpectrum:
    """Return the one-sided power spectral density of a torque, by the plain periodogram.

    The mean is taken off and no window is applied, so that by Parseval's theorem the density sums,
    times the spacing, to the variance.

    Parameters
    ----------
    torque_nm : array, shape (n,)
        In N·m, evenly sampled.
    rate_hz : float
        Samples a second.
    """
    frequency_hz, density_n2m2_hz = scipy.signal.periodogram(
        np.asarray(torque_nm, dtype=np.float64), fs=rate_hz, detrend="constant"
    )
    return TorqueSpectrum(frequency_hz, density_n2m2_hz)


@dataclass(frozen=True)
class BandCheck:
    """What the sequence excites, against what is wanted of it.

    Attributes
    ----------
    covered, low_covered, high_covered : bool
        Whether both, the lower and the upper edge of the wanted band are covered.
    lowest_hz : float
        The lowest frequency excited: the first line, at `line_spacing_hz` = f_clock / (2ⁿ − 1), or
        one over the duration where the epoch is shorter than a period.
    lines_in_band : int
        How many whole multiples of `lowest_hz` lie in the wanted band.
    half_power_hz, drop_edge_hz : float
        Where the envelope is at half its plateau (−3 dB), and where it is `drop_db` below it.
    power_low_db, power_high_db : float
        The envelope at the wanted edges relative to its plateau; −120 dB stands for none.
    plateau_n2m2_hz : float
        The density of the plateau, in N²m²/Hz.
    in_band_percent : float
        How much of the actual sequence's variance lies in the wanted band.
    enough : PrbsSettings
        Settings that cover the band: those given where they do; otherwise with bits, clock and
        duration raised as far as needed, the clock and duration rounded up to a tenth.
    enough_rate_hz : float
        The tick rate that covers the band, likewise.
    verdict : str
        All of this in sentences.
    """

    covered: bool
    low_covered: bool
    high_covered: bool
    wanted_low_hz: float
    wanted_high_hz: float
    line_spacing_hz: float
    lowest_hz: float
    lines_in_band: int
    half_power_hz: float
    drop_db: float
    drop_edge_hz: float
    power_low_db: float
    power_high_db: float
    plateau_n2m2_hz: float
    in_band_percent: float
    enough: PrbsSettings
    enough_rate_hz: float
    verdict: str


def check_band(settings: PrbsSettings, rate_hz: float) -> BandCheck:
    """Hold the sequence against the wanted band.

    The lower edge is covered when the lowest frequency excited lies no more than half a line
    spacing above it. The upper edge is covered when the envelope has fallen by no more than
    `DROP_DB` on the way there, and the tick rate is at least twice that frequency.

    Parameters
    ----------
    settings : PrbsSettings
        The sequence and the wanted band.
    rate_hz : float
        Ticks a second.

    Raises
    ------
    ValueError, UserError
        As `prbs_nm`.
    """
    low_hz, high_hz = settings.wanted_low_hz, settings.wanted_high_hz
    lowest_hz = max(line_spacing_hz(settings), 1.0 / settings.duration_s)
    drop_edge_hz = envelope_edge_hz(settings.clock_hz, DROP_DB)
    low_covered = lowest_hz <= 2.0 * low_hz
    high_covered = high_hz <= drop_edge_hz and high_hz <= rate_hz / 2.0
    enough = _enough(settings)
    enough_rate_hz = max(rate_hz, 2.0 * high_hz, enough.clock_hz)
    power_low_db, power_high_db = envelope_db([low_hz, high_hz], settings.clock_hz)
    spectrum = power_spectrum(prbs_nm(settings, rate_hz), rate_hz)
    sentences = [
        _low_sentence(settings, lowest_hz, low_covered),
        _high_sentence(settings, rate_hz, float(power_high_db)),
        *_period_and_changes(settings, enough, rate_hz, enough_rate_hz),
    ]
    covered = low_covered and high_covered
    first_line = max(1, math.ceil(low_hz / lowest_hz - _ROUNDING))
    band = f"{low_hz:g}–{high_hz:g} Hz"
    opening = f"The wanted band {band} is {'covered' if covered else 'not covered'}."
    return BandCheck(
        covered=covered,
        low_covered=low_covered,
        high_covered=high_covered,
        wanted_low_hz=low_hz,
        wanted_high_hz=high_hz,
        line_spacing_hz=line_spacing_hz(settings),
        lowest_hz=lowest_hz,
        lines_in_band=max(0, math.floor(high_hz / lowest_hz + _ROUNDING) - first_line + 1),
        half_power_hz=envelope_edge_hz(settings.clock_hz),
        drop_db=DROP_DB,
        drop_edge_hz=drop_edge_hz,
        power_low_db=float(power_low_db),
        power_high_db=float(power_high_db),
        plateau_n2m2_hz=plateau_n2m2_hz(settings),
        in_band_percent=100.0 * spectrum.share(low_hz, high_hz),
        enough=enough,
        enough_rate_hz=enough_rate_hz,
        verdict=" ".join([opening, *sentences]),
    )


def _tenth_up(value: float) -> float:
    return math.ceil(value * 10.0 - _ROUNDING) / 10.0


def _enough(settings: PrbsSettings) -> PrbsSettings:
    """Return settings that cover the wanted band, changing as little as possible."""
    min_clock_hz = settings.wanted_high_hz / envelope_edge_hz(1.0, DROP_DB)
    clock_hz = settings.clock_hz
    if envelope_edge_hz(clock_hz, DROP_DB) < settings.wanted_high_hz:
        clock_hz = _tenth_up(min_clock_hz * (1.0 + _ROUNDING))
    bits = settings.register_bits
    while clock_hz / (2**bits - 1) > 2.0 * settings.wanted_low_hz:
        bits += 1
    duration_s = settings.duration_s
    if 1.0 / duration_s > 2.0 * settings.wanted_low_hz:
        duration_s = _tenth_up(0.5 / settings.wanted_low_hz * (1.0 + _ROUNDING))
    return settings.model_copy(
        update={"clock_hz": clock_hz, "register_bits": bits, "duration_s": duration_s}
    )


def _low_sentence(settings: PrbsSettings, lowest_hz: float, covered: bool) -> str:
    wanted_hz = settings.wanted_low_hz
    first = (
        "line" if lowest_hz == line_spacing_hz(settings) else "frequency that the epoch resolves"
    )
    found = f"The first {first} is at {lowest_hz:.4g} Hz"
    if lowest_hz <= wanted_hz:
        return f"{found}, at or below the lower edge."
    above = f"{100.0 * (lowest_hz / wanted_hz - 1.0):.0f} % above the lower edge"
    if covered:
        return f"{found}, {above}; within half a line spacing, which counts as covered."
    return f"{found}, {above} and more than half a line spacing from it."


def _high_sentence(settings: PrbsSettings, rate_hz: float, power_high_db: float) -> str:
    high_hz = settings.wanted_high_hz
    if high_hz > rate_hz / 2.0:
        return f"{high_hz:g} Hz is above half the tick rate of {rate_hz:g} Hz."
    edge_hz = envelope_edge_hz(settings.clock_hz, DROP_DB)
    half_hz = envelope_edge_hz(settings.clock_hz)
    return (
        f"At {high_hz:g} Hz the power is {-power_high_db:.2f} dB below the plateau; {DROP_DB:g} dB "
        f"is allowed, up to {edge_hz:.2f} Hz (3 dB: {half_hz:.2f} Hz)."
    )


def _period_and_changes(
    settings: PrbsSettings, enough: PrbsSettings, rate_hz: float, enough_rate_hz: float
) -> Iterator[str]:
    periods = settings.duration_s / prbs_period_s(settings)
    if periods < 1.0:
        yield (
            f"The epoch holds only {100.0 * periods:.0f} % of a period, so its spectrum is flat "
            "only on average."
        )
    changes = [
        f"{name} ≥ {new:g}{unit}"
        for name, old, new, unit in (
            ("prbs.clock_hz", settings.clock_hz, enough.clock_hz, " Hz"),
            ("prbs.register_bits", settings.register_bits, enough.register_bits, ""),
            ("prbs.duration_s", settings.duration_s, enough.duration_s, " s"),
            ("rig.tick_rate_hz", rate_hz, enough_rate_hz, " Hz"),
        )
        if new > old
    ]
    if changes:
        yield f"To cover it: {', '.join(changes)}."
