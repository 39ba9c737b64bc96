"""The perturbation (Fig. 3b and 4a), and what can be counted: cycles, minutes, epochs.

Register and clock of the perturbation are not printed. A maximal sequence of n bits at a clock f
has its lowest line at f/(2ⁿ − 1) and half its power density at 0.443 f, so that one lies
0.443 (2ⁿ − 1) times above the other: 56 for seven bits, 113 for eight, and 67 in the paper. Seven
bits at 20 Hz have the printed lower end, at 22.6 Hz the upper one.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from rigidimeter.analysis.estimation import scoring_cycles
from rigidimeter.analysis.figures import draw_perturbation, draw_spectrum, drawn
from rigidimeter.analysis.report import Figure
from rigidimeter.core.records import Channel
from rigidimeter.core.settings import BlockSettings
from rigidimeter.core.words import number
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import Bound, Claim, bounded, near, within_percent
from rigidimeter.paper.context import Context
from rigidimeter.paper.score_rows import imposed_epoch
from rigidimeter.planning import check_band, plan, power_spectrum, prbs_nm

_CYCLES = 8
_DAYS = {"OFF": 9, "DBS": 4}
_EXAMINERS = 3

RIGIDITY_RETURNS_MIN = (30.0, 60.0)
"""After STN DBS is switched off, in 35 patients (Temperli et al., Neurology 2003;60:78–81)."""


def _perturbation(context: Context) -> Channel:
    rate_hz = context.settings.rig.tick_rate_hz
    values = prbs_nm(context.settings.prbs, rate_hz)
    return Channel("perturbation_nm", np.arange(values.size) / rate_hz, values)


def figure_3b(context: Context) -> Claim:
    """Compare the power spectral density of the perturbation."""
    prbs, rate_hz = context.settings.prbs, context.settings.rig.tick_rate_hz
    low_hz, high_hz = printed.EXCITED_HZ
    band = check_band(prbs, rate_hz)
    half = band.half_power_hz / prbs.clock_hz  # whatever the clock
    reaching_hz = high_hz / half
    channel = _perturbation(context)
    share = power_spectrum(channel.values, rate_hz).share(low_hz, high_hz)
    return Claim(
        ours=f"7 bits at {prbs.clock_hz:g} Hz: lines from {number(band.line_spacing_hz)} "
        f"Hz on, {number(band.power_high_db, 3)} dB at {high_hz:g} Hz, half power at "
        f"{number(band.half_power_hz, 3)} Hz, {number(100 * share, 3)} % of the power in the band",
        checks=(
            near("Lowest line", "Hz", low_hz, band.line_spacing_hz, 0.01),
            near("Half power", "Hz", high_hz, band.half_power_hz, 0.5),
        ),
        reading="Register and clock are not printed. The band reaches from the lowest line to half "
        f"power; 7 bits at {prbs.clock_hz:g} Hz have its lower end, at "
        f"{number(reaching_hz, 3)} Hz they would have its upper end and a lowest line at "
        f"{number(reaching_hz / (2**prbs.register_bits - 1), 3)} Hz.",
        differs="No maximal sequence has both ends: its half power is at "
        f"{half * (2**7 - 1):.0f} times the lowest line with 7 bits and at "
        f"{half * (2**8 - 1):.0f} times with 8, in the paper at {high_hz / low_hz:.0f} times.",
        figures=(
            Figure(
                "fig-3b",
                "Fig. 3(b) computed for a 7-bit sequence at 20 Hz; shaded: the band the paper "
                "names.",
                "Power spectral density of the perturbation with the band 0.15 to 10 Hz marked.",
                partial(drawn, (7.4, 2.7), draw_spectrum, channel, printed.EXCITED_HZ),
            ),
        ),
    )


def figure_4a(context: Context) -> Claim:
    """Compare the perturbation over time."""
    prbs = context.settings.prbs
    channel = _perturbation(context)
    levels = np.unique(channel.values)
    mean = round(float(channel.values.mean()), 9) + 0.0  # free of the rounding of the sum
    duration_s = channel.values.size / context.settings.rig.tick_rate_hz
    return Claim(
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
        figures=(
            Figure(
                "fig-4a",
                "Fig. 4(a) with our sequence.",
                "The two-level torque perturbation over 20 s, its first seconds enlarged.",
                partial(drawn, (7.4, 3.1), draw_perturbation, channel, 0.0, rows=2),
            ),
        ),
    )


def cycles_counted(context: Context, motion_s: float) -> int:
    """Return how many cycles are scored when the 20 s epoch holds so much motion."""
    settings = context.settings
    sinusoid = settings.sinusoid.model_copy(update={"motion_s": motion_s})
    scores = settings.scores.model_copy(update={"cycles": 1000})  # as many as there are
    changed = settings.model_copy(update={"sinusoid": sinusoid})
    return scoring_cycles(imposed_epoch(printed.FIG_6, changed), scores).n_cycles


def cycles_of_motion(context: Context) -> Claim:
    """Compare how many cycles 10 s of motion less two seconds hold."""
    count = cycles_counted(context, 10.0)
    return Claim(
        ours=f"{count} cycles", checks=(near("Cycles of 10 s of motion", "1", _CYCLES, count, 0.0),)
    )


def cycles_of_epoch(context: Context) -> Claim:
    """Compare how many cycles 20 s of motion would hold."""
    count = cycles_counted(context, 20.0)
    return Claim(
        ours=f"{count} cycles", checks=(near("Cycles of 20 s of motion", "1", _CYCLES, count, 0.0),)
    )


def session_length(context: Context) -> Claim:
    """Compare how long fifteen epochs take with their rests."""
    settings = context.settings
    block = BlockSettings(task="sinusoid", condition="OFF", epochs=printed.EPOCHS_A_CONDITION)
    protocol = settings.protocol.model_copy(update={"blocks": [block]})
    total_min = plan(protocol, settings.prbs, settings.sinusoid, settings.seed).total_s / 60.0
    return Claim(
        ours=f"{number(total_min, 3)} min, rests drawn at random",
        checks=(within_percent("15 epochs", "min", printed.SESSION_MIN, total_min, 25.0),),
    )


def table_1(context: Context) -> Claim:
    """Compare the counts with days, examiners and epochs a day."""
    ratings, sines = printed.TABLE_1["ratings"], printed.TABLE_1["sinusoid"]
    rated = {name: days * _EXAMINERS for name, days in _DAYS.items()}
    planned = {name: days * printed.EPOCHS_A_CONDITION for name, days in _DAYS.items()}
    listed = "; ".join(
        f"{task} {numbers['OFF']}/{numbers['DBS']}" for task, numbers in context.counts.items()
    )
    return Claim(
        ours=f"9 and 4 days times 3 examiners: {rated['OFF']} and "
        f"{rated['DBS']} ratings; 15 epochs a day: {planned['OFF']} and "
        f"{planned['DBS']} sinusoids; our virtual study has {listed}",
        checks=(
            *(near(f"Ratings {name}", "1", ratings[name], rated[name], 0.0) for name in _DAYS),
            *(near(f"Sinusoids {name}", "1", sines[name], planned[name], 0.0) for name in _DAYS),
        ),
        differs="The ratings fit. Of the sinusoids "
        + " and ".join(f"{planned[name] - sines[name]} in {name}" for name in _DAYS)
        + " are missing, and the text names no rule by which one was left out.",
    )


def sequences(context: Context) -> Claim:
    """Compare the two statements on how many perturbation sequences there were."""
    count = sum(printed.TABLE_1["prbs"].values())
    return Claim(
        ours=f"Sec. 2.5 and Table 1 together: {count} epochs with distinct sequences",
        checks=(near("Sequences", "1", 1, count, 0.0),),
    )


def wash_out(context: Context) -> Claim:
    """Compare the wait before OFF with the published time in which rigidity returns."""
    early_min, late_min = RIGIDITY_RETURNS_MIN
    waited_min = printed.WASH_OUT_MIN
    return Claim(
        ours=f"rigidity returned over {early_min:g} to {late_min:g} min in 35 patients (Temperli "
        "et al., Neurology 2003;60:78–81)",
        checks=(
            Bound("Rigidity has returned after", "min", waited_min, late_min, 0.0, waited_min),
        ),
    )


def one_stiffness(context: Context) -> Claim:
    """Compare the three values of the median stiffness."""
    values = [joint.stiffness_nm_rad for joint in (printed.SEC_34, printed.FIG_4, printed.FIG_6)]
    spread_percent = 100.0 * (max(values) / min(values) - 1.0)
    return Claim(
        ours=f"largest over smallest +{number(spread_percent, 3)} %; 1.130 is 1.310 with two "
        "digits exchanged",
        checks=(bounded("Spread of K", "%", spread_percent, high=0.5),),
    )
