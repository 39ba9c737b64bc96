"""Estimates as they are shown on a terminal: one screen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from rigidimeter.analysis.estimation import METHODS
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.recording import OF_SCORES, condition_precisions
from rigidimeter.analysis.statistics import Precision
from rigidimeter.cli.notes import finding_notes, stiffness_notes, two_lines
from rigidimeter.cli.terminal_tables import ROWS, Block, Heading, Table, text_lines
from rigidimeter.core.records import PARAMETERS, Analysis, Delay, Fit, Score, degrees
from rigidimeter.core.settings import Settings
from rigidimeter.core.words import (
    decimals,
    epoch_name,
    fixed,
    number,
    plural,
    scaled,
    short_names,
    with_error,
)

Precisions = Mapping[str, Mapping[str, Precision]]
"""By condition and measure."""

MOST_EPOCHS, FIRST_EPOCHS = 8, 4
"""Of more epochs than the first number the second and the last are shown, of several recordings
none."""

SIGNIFICANT, LEAST_S = 3.0, 1e-4
"""Standard errors; a delay below is not shown, nor one that is too short to be corrected."""

MORE = "--full: every table · --json FILE: every number · rigidimeter explain NAME"


def estimate_blocks(read: Recording, analysis: Analysis, *, full: bool = False) -> Iterator[Block]:
    """Yield the first screen: J, B and K of the epochs and together, scores, what was found.

    With `full` every finding, and the tables of the report. Otherwise as many epochs one by one as
    one screen has room for.
    """
    precisions = condition_precisions(read, analysis)
    found = (
        stiffness_notes(analysis),
        _method(analysis),
        _excluded(analysis),
        _short_scores(read.settings, analysis),
        _delays(analysis, full),
    )
    notes = [note for notes in (*found, finding_notes(analysis, full)) for note in notes]

    def first_screen(most: int) -> list[Block]:
        fits = _fits(analysis, precisions, most)
        blocks: list[Block] = [Heading(_about(read, analysis))]
        tables = (fits, _scores(precisions), Table((), notes, "<<", 1))
        for table in tables:
            if table.rows:
                blocks += ["", table]
        return blocks if full else [*blocks, "", MORE]

    screens = map(first_screen, (MOST_EPOCHS, FIRST_EPOCHS + 2, 0))
    yield from next((one for one in screens if len(text_lines(one)) <= ROWS), first_screen(0))
    if full:
        from rigidimeter.analysis.report import Shown
        from rigidimeter.cli.comparison_text import full_blocks
        from rigidimeter.cli.inputs import command_line

        shown = Shown.of_recording(read, analysis, command_line())
        yield from full_blocks(shown, by_epoch=True)


def _about(read: Recording, analysis: Analysis) -> str:
    """Return what was read, and how it was estimated."""
    names = list(short_names({one.source for one in analysis.results}).values())
    parts = [names[0] if len(names) == 1 else plural(len(names), "recording")]
    if any(epoch.virtual for epoch in read.epochs):
        parts.append("virtual data")
    if analysis.fits:
        used = sum(fit.outcome.included for fit in analysis.fits)
        epochs = plural(len(analysis.fits), "epoch")
        parts.append(epochs if used == len(analysis.fits) else f"{epochs}, {used} used")
    if analysis.scores:
        parts.append(plural(len(analysis.scores), "sinusoid"))
    if analysis.fits:
        parts.append(f"method {analysis.method}")
        bands = {fit.band_hz for fit in analysis.fits if fit.n_samples}
        parts += [f"{low:.3g} to {high:.3g} Hz" for low, high in sorted(bands)[:1]]
    return " · ".join(parts)


def _fits(analysis: Analysis, precisions: Precisions, most: int) -> Table:
    """Return a row for each epoch, ± one standard error, and the rows of all together.

    Of more than `most` epochs of one recording the first and the last, of several none.
    """
    fits = analysis.fits
    names = short_names({fit.source for fit in fits})
    scales = [
        scaled(max((abs(fit.value[i]) for fit in fits), default=0.0), parameter.unit)
        for i, parameter in enumerate(PARAMETERS)
    ]

    def row(fit: Fit) -> tuple[str, ...]:
        label = fit.epoch if len(names) == 1 else f"{names[fit.source]} {fit.epoch}"
        values = [
            with_error(factor * fit.value[i], factor * fit.se[i])
            for i, (factor, _) in enumerate(scales)
        ]
        angle = degrees(fit.angle_rms_rad)
        vaf = "–" if math.isnan(fit.vaf_percent) else f"{fit.vaf_percent:.1f}"
        outcome = "" if fit.outcome.included else fit.outcome.kind
        return (label, fit.condition, *values, angle, vaf, outcome)

    together = [*_together(precisions, [factor for factor, _ in scales])]
    rows: list[Sequence[str] | str] = []
    if len(fits) <= most:
        rows += map(row, fits)
    elif len(names) == 1 and most:
        rows += [*map(row, fits[:FIRST_EPOCHS]), ("…", *[""] * 7), row(fits[-1])]
    else:
        together = together[1:]  # without the empty line
    rows += together
    headings = ("epoch", "", *(f"{p.symbol}, {unit}" for p, (_, unit) in
                zip(PARAMETERS, scales, strict=True)), "SD θ, °", "VAF, %", "")  # fmt: skip
    return Table(headings, rows, "<<>>>>>=", 1)


def _together(precisions: Precisions, factors: Sequence[float]) -> Iterator[Sequence[str] | str]:
    """Yield value, interval and scatter of each condition's epochs together."""
    for condition, by_name in precisions.items():
        found = [by_name[p.name] for p in PARAMETERS if p.name in by_name]
        if len(found) < len(PARAMETERS):
            continue
        cells = []
        for one, factor in zip(found, factors, strict=True):
            value, low, high = (factor * size for size in (one.value, one.low, one.high))
            places = decimals((high - low) / 2, value)
            interval = f"{fixed(low, places)} to {fixed(high, places)}"
            scatter = "–" if math.isnan(one.sd_percent) else f"{number(one.sd_percent, 2)} %"
            known = "–" if math.isnan(low) else interval
            cells.append((fixed(value, places), known, scatter))
        values, intervals, scatters = zip(*cells, strict=True)
        yield ""
        yield ("together", condition, *values, "", "", "")
        yield ("95 %", "", *intervals, "", "", "")
        yield ("SD", "", *scatters, "", "", "")


def _scores(precisions: Precisions) -> Table:
    """Return the mean of the scores of each condition, per cycle."""
    rows = []
    for condition, by_name in precisions.items():
        found = [by_name[name] for name in OF_SCORES if name in by_name]
        cells = [
            f"{number(one.value, 3)} (SD {number(one.sd_percent, 2)} %)"
            if not math.isnan(one.sd_percent)
            else number(one.value, 3)
            for one in found
        ]
        if cells:
            rows.append((condition or "all", str(found[0].n), *cells))
    return Table(("sinusoids", "epochs", "impulse, N·m·s", "work, J"), rows, "<>>>", 1)


def _method(analysis: Analysis) -> Iterator[tuple[str, str]]:
    """Yield why a method was chosen that the subject's own torque biases."""
    chosen = [method for method in METHODS if method.name == analysis.method]
    if analysis.fits and chosen and not any(method.uses_perturbation for method in chosen):
        reason = analysis.method_reason or "as chosen"
        texts = (reason, reason.rpartition(": ")[0] or reason)
        yield "method", two_lines(*(f"{analysis.method}: {text}" for text in texts))


def _excluded(analysis: Analysis) -> Iterator[tuple[str, str]]:
    """Yield which epochs do not count, and why, in two lines for each outcome."""
    names = short_names(one.source for one in analysis.results)
    out: dict[str, list[Fit | Score]] = {}
    for one in analysis.results:
        if not one.outcome.included:
            out.setdefault(one.outcome.kind, []).append(one)
    for kind, those in out.items():
        first = epoch_name(those[0].epoch, those[0].source, names)
        where = first if len(those) == 1 else f"{plural(len(those), 'epoch')}, first {first}"
        reason = those[0].outcome.reason
        yield kind, two_lines(f"{where}: {reason}", f"{where}: {reason.partition('. ')[0]}", where)


def _short_scores(settings: Settings, analysis: Analysis) -> Iterator[tuple[str, str]]:
    """Yield that sinusoids were scored over fewer cycles than the settings say."""
    wanted, scores = settings.scores, analysis.scores
    short = [score.n_cycles for score in scores if 0 < score.n_cycles < wanted.cycles]
    if short:
        text = (
            f"{len(short)} of {len(scores)} sinusoids were scored over fewer than scores.cycles = "
            f"{wanted.cycles} cycles, the fewest {min(short)}"
        )
        yield "caution", text


def _delays(analysis: Analysis, full: bool) -> Iterator[tuple[str, str]]:
    """Yield how late the torque is in each source, where that is known; of several the largest."""
    names = short_names(delay.source for delay in analysis.delays)
    known = [delay for delay in analysis.delays if math.isfinite(delay.delay_s)]
    late = [delay for delay in known if delay.corrected or _is_shown(delay)]
    late.sort(key=lambda delay: -abs(delay.delay_s))
    for delay in late if full else late[:1]:
        done = "corrected" if delay.corrected else delay.remark
        side = "later" if delay.delay_s > 0 else "earlier"
        size = with_error(1e3 * abs(delay.delay_s), 1e3 * delay.delay_s_se)
        text = f"torque {size} ms {side} than the motion in {names[delay.source]}"
        if len(late) > 1 and not full:
            text += f", the most of {plural(len(late), 'recording')}"
        texts = [f"{text}: {done}", f"{text}: {done.partition(': ')[0]}", text]
        yield "delay", texts[0] if full else two_lines(*texts)
    fitted = {fit.source for fit in analysis.fits}
    unknown = [one for one in analysis.delays if one.remark and one.source in fitted]
    unknown = [one for one in unknown if not math.isfinite(one.delay_s)]
    for delay in unknown if full else unknown[:1]:
        text = f"{names[delay.source]}: {delay.remark}"
        if len(unknown) > 1 and not full:
            text = f"{names[delay.source]} and {len(unknown) - 1} more: {delay.remark}"
        yield "delay", text if full else two_lines(text, text.partition(": ")[0] + ": unknown")


def _is_shown(delay: Delay) -> bool:
    return abs(delay.delay_s) >= max(LEAST_S, SIGNIFICANT * delay.delay_s_se)
