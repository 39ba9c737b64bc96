"""The perturbation: its band (Fig. 3b) and its course (Fig. 4a).

Register and clock are not printed. Seven bits at 20 Hz are the shortest maximal sequence whose
lines, 20/127 Hz apart, begin at 0.157 Hz and whose envelope still has more than a third of its
power density at 10 Hz.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from rigidimeter.experiment import check_band, power_spectrum, prbs_nm
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import AGREES, Picture, Row, bounded, near
from rigidimeter.paper.context import Workshop
from rigidimeter.records import Channel
from rigidimeter.reporting.numbers import number
from rigidimeter.reporting.sections.perturbation_figure import perturbation, spectrum
from rigidimeter.reporting.style import svg_text

__all__ = ["ROWS"]

EDGE_DB = -6.0
"""Down to where the envelope counts as exciting."""


def _channel(workshop: Workshop) -> Channel:
    settings = workshop.settings
    values = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    time_s = np.arange(values.size) / settings.rig.tick_rate_hz
    return Channel("perturbation_nm", time_s, values)


def figure_3b(workshop: Workshop) -> Row:
    """Make the row: the power spectral density of the perturbation."""
    settings = workshop.settings
    low_hz, high_hz = printed.BAND_HZ
    band = check_band(settings.prbs, settings.rig.tick_rate_hz)
    channel = _channel(workshop)
    share = power_spectrum(channel.values, settings.rig.tick_rate_hz).share(low_hz, high_hz)
    return Row(
        id="fig-3b",
        source="Fig. 3(b), Sec. 2.4.3",
        paper=f"effective band {low_hz:g}–{high_hz:g} Hz",
        ours=f"7 bits at {settings.prbs.clock_hz:g} Hz: lines from {number(band.line_spacing_hz)} "
        f"Hz on, {number(band.power_high_db, 3)} dB at {high_hz:g} Hz, half power at "
        f"{number(band.half_power_hz, 3)} Hz, {number(100 * share, 3)} % of the power in the band",
        reading="Register and clock are not printed; 7 bits at 20 Hz give this band (22.6 Hz puts "
        "half power at 10 Hz).",
        checks=(
            near("Lowest line", "Hz", low_hz, band.line_spacing_hz, 0.01),
            bounded("Envelope at 10 Hz", "dB", band.power_high_db, low=EDGE_DB),
            bounded("Power within the band", "%", 100 * share, low=50.0),
        ),
        because={AGREES: "The sequence we had to choose excites the printed band."},
        pictures=(
            Picture(
                "fig-3b",
                svg_text(spectrum(channel, printed.BAND_HZ)),
                "Power spectral density of the perturbation with the band 0.15 to 10 Hz marked.",
                "Fig. 3(b) computed for a 7-bit sequence at 20 Hz; shaded: the band the paper "
                "names.",
            ),
        ),
    )


def figure_4a(workshop: Workshop) -> Row:
    """Make the row: the perturbation over time."""
    prbs = workshop.settings.prbs
    channel = _channel(workshop)
    levels = np.unique(channel.values)
    mean = round(float(channel.values.mean()), 9) + 0.0  # free of the rounding of the sum
    duration_s = channel.values.size / workshop.settings.rig.tick_rate_hz
    return Row(
        id="fig-4a",
        source="Fig. 4(a), Sec. 2.4.3",
        paper="zero mean, ±1 N·m, 20 s, the same sequence in every epoch",
        ours=f"mean {number(mean)} N·m, "
        f"{len(levels)} levels {' and '.join(number(float(v), 3) for v in levels)} N·m, "
        f"{duration_s:g} s, from one register start",
        reading=f"{prbs.register_bits} bits at {prbs.clock_hz:g} Hz, starting from all ones; the "
        "levels are shifted alike so that the mean is zero.",
        checks=(
            near("Mean", "N·m", 0.0, mean, 1e-6),
            near("Upper level", "N·m", 1.0, float(levels[-1]), 0.05),
            near("Lower level", "N·m", -1.0, float(levels[0]), 0.05),
            near("Duration", "s", 20.0, duration_s, 0.0),
        ),
        because={AGREES: "What is said of the sequence holds for ours; the sequence itself was "
                 "not published, so the order of its steps cannot be compared."},
        pictures=(
            Picture(
                "fig-4a",
                svg_text(perturbation(channel, 0.0)),
                "The two-level torque perturbation over 20 s, its first seconds enlarged.",
                "Fig. 4(a) with our sequence.",
            ),
        ),
    )  # fmt: skip


ROWS: Mapping[str, Callable[[Workshop], Row]] = {"fig-3b": figure_3b, "fig-4a": figure_4a}
