"""Whether the perturbation covers the band that the estimation wants, and what would.

The paper calls 0.15–10 Hz the effective band of its sequence (Sec. 2.4.3) and prints neither clock
nor length. Seven bits at 20 Hz fit: the first line is at 0.1575 Hz and the envelope at 10 Hz is
3.92 dB down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rigidimeter.experiment.perturbation_spectrum import (
    envelope_db,
    envelope_edge_hz,
    line_spacing_hz,
    plateau_n2m2_hz,
    power_spectrum,
)
from rigidimeter.experiment.prbs import period_s, prbs_nm
from rigidimeter.settings import PrbsSettings

__all__ = ["DROP_DB", "BandCheck", "check_band"]

DROP_DB = 6.0
"""How far below its plateau the perturbation may be at an edge of the wanted band."""

_ROUNDING = 1e-9


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


def check_band(settings: PrbsSettings, rate_hz: float, *, drop_db: float = DROP_DB) -> BandCheck:
    """Hold the sequence against the wanted band.

    The lower edge is covered when the lowest frequency excited lies no more than half a line
    spacing above it. The upper edge is covered when the envelope has fallen by no more than
    `drop_db` on the way there, and the tick rate is at least twice that frequency.

    Parameters
    ----------
    settings : PrbsSettings
        The sequence and the wanted band.
    rate_hz : float
        Ticks a second.
    drop_db : float
        In dB, above 0.

    Raises
    ------
    ValueError, UserError
        As `prbs_nm` and `envelope_edge_hz`.
    """
    low_hz, high_hz = settings.wanted_low_hz, settings.wanted_high_hz
    lowest_hz = _lowest_hz(settings)
    drop_edge_hz = envelope_edge_hz(settings.clock_hz, drop_db)
    low_covered = lowest_hz <= 2.0 * low_hz
    high_covered = high_hz <= drop_edge_hz and high_hz <= rate_hz / 2.0
    enough = _enough(settings, drop_db)
    enough_rate_hz = max(rate_hz, 2.0 * high_hz, enough.clock_hz)
    power_low_db, power_high_db = envelope_db([low_hz, high_hz], settings.clock_hz)
    spectrum = power_spectrum(prbs_nm(settings, rate_hz), rate_hz)
    sentences = [
        _low_sentence(settings, lowest_hz, low_covered),
        _high_sentence(settings, rate_hz, float(power_high_db), drop_db),
        *_period_sentence(settings),
        *_change_sentence(settings, enough, rate_hz, enough_rate_hz),
    ]
    covered = low_covered and high_covered
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
        lines_in_band=_multiples(lowest_hz, low_hz, high_hz),
        half_power_hz=envelope_edge_hz(settings.clock_hz),
        drop_db=drop_db,
        drop_edge_hz=drop_edge_hz,
        power_low_db=float(power_low_db),
        power_high_db=float(power_high_db),
        plateau_n2m2_hz=plateau_n2m2_hz(settings),
        in_band_percent=100.0 * spectrum.share(low_hz, high_hz),
        enough=enough,
        enough_rate_hz=enough_rate_hz,
        verdict=" ".join([opening, *sentences]),
    )


def _lowest_hz(settings: PrbsSettings) -> float:
    return max(line_spacing_hz(settings), 1.0 / settings.duration_s)


def _multiples(spacing_hz: float, low_hz: float, high_hz: float) -> int:
    first = max(1, math.ceil(low_hz / spacing_hz - _ROUNDING))
    return max(0, math.floor(high_hz / spacing_hz + _ROUNDING) - first + 1)


def _tenth_up(value: float) -> float:
    return math.ceil(value * 10.0 - _ROUNDING) / 10.0


def _enough(settings: PrbsSettings, drop_db: float) -> PrbsSettings:
    """Return settings that cover the wanted band, changing as little as possible."""
    least_clock_hz = settings.wanted_high_hz / envelope_edge_hz(1.0, drop_db)
    clock_hz = settings.clock_hz
    if envelope_edge_hz(clock_hz, drop_db) < settings.wanted_high_hz:
        clock_hz = _tenth_up(least_clock_hz * (1.0 + _ROUNDING))
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


def _high_sentence(
    settings: PrbsSettings, rate_hz: float, power_high_db: float, drop_db: float
) -> str:
    high_hz = settings.wanted_high_hz
    if high_hz > rate_hz / 2.0:
        return f"{high_hz:g} Hz is above half the tick rate of {rate_hz:g} Hz."
    edge_hz = envelope_edge_hz(settings.clock_hz, drop_db)
    half_hz = envelope_edge_hz(settings.clock_hz)
    return (
        f"At {high_hz:g} Hz the power is {-power_high_db:.2f} dB below the plateau; {drop_db:g} dB "
        f"is allowed, up to {edge_hz:.2f} Hz (3 dB: {half_hz:.2f} Hz)."
    )


def _period_sentence(settings: PrbsSettings) -> list[str]:
    periods = settings.duration_s / period_s(settings)
    if periods >= 1.0:
        return []
    return [
        f"The epoch holds only {100.0 * periods:.0f} % of a period, so its spectrum is flat only "
        "on average."
    ]


def _change_sentence(
    settings: PrbsSettings, enough: PrbsSettings, rate_hz: float, enough_rate_hz: float
) -> list[str]:
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
    return [f"To cover it: {', '.join(changes)}."] if changes else []
