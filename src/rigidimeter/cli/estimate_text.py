"""Estimates as they are shown on a terminal: one screen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rigidimeter.cli.comparison_text import finding_notes, full_blocks
from rigidimeter.cli.terminal_tables import Block, Heading, Table

if TYPE_CHECKING:
    from rigidimeter.analysis.study import Precision, StudyResult
    from rigidimeter.core.records import Analysis, Fit, Score

MOST_EPOCHS, FIRST_EPOCHS = 8, 4
"""Of more epochs than the first number the second and the last are shown, of several recordings
none."""

MOST_NOTES = 3
SIGNIFICANT = 3.0
"""Standard errors; a delay below is not shown."""

MORE = "--full: every table · --json FILE: every number · rigidimeter explain NAME"


def estimate_blocks(result: StudyResult, *, full: bool = False) -> Iterator[Block]:
    """Yield the first screen: J, B and K of the epochs and together, scores, what was found.

    With `full` every finding, and the tables of the report.
    """
    analysis = result.analysis
    yield Heading(_about(result))
    if analysis.fits and (fits := _fits(result)).rows:
        yield ""
        yield fits
    if (scores := _scores(result)).rows:
        yield ""
        yield scores
    found = (_method(analysis), _excluded(analysis), _short_scores(result), _delays(analysis))
    notes = [note for notes in (*found, finding_notes(analysis, full)) for note in notes]
    if notes:
        yield ""
        yield Table((), notes, "<<", 1)
    if full:
        yield from full_blocks(result, by_epoch=True)
    else:
        yield from ("", MORE)


def _about(result: StudyResult) -> str:
    """Return what was read, and how it was estimated."""
    from rigidimeter.core.words import plural, short_names

    analysis = result.analysis
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    sources = {one.source for one in results}
    names = list(short_names(sources).values())
    parts = [names[0] if len(names) == 1 else plural(len(names), "recording")]
    if any(epoch.virtual for epoch in result.epochs):
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


def _fits(result: StudyResult) -> Table:
    """Return a row for each epoch, ± one standard error, and the rows of all together."""
    from rigidimeter.core.records import PARAMETERS
    from rigidimeter.core.words import scaled, short_names, with_error

    fits = result.analysis.fits
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
        vaf = "–" if math.isnan(fit.vaf_percent) else f"{fit.vaf_percent:.1f}"
        outcome = "" if fit.outcome.included else fit.outcome.kind
        return (label, fit.condition, *values, vaf, outcome)

    together = [*_together(result, [factor for factor, _ in scales])]
    rows: list[Sequence[str] | str] = []
    if len(fits) <= MOST_EPOCHS:
        rows += map(row, fits)
    elif len(names) == 1:
        rows += [*map(row, fits[:FIRST_EPOCHS]), ("…", *[""] * 6), row(fits[-1])]
    else:
        together = together[1:]  # without the empty line
    rows += together
    headings = ("epoch", "condition", *(f"{p.symbol}, {unit}" for p, (_, unit) in
                zip(PARAMETERS, scales, strict=True)), "VAF, %", "")  # fmt: skip
    return Table(headings, rows, "<<>>>>=", 1)


def _together(result: StudyResult, factors: Sequence[float]) -> Iterator[Sequence[str] | str]:
    """Yield value, interval and scatter of each condition's epochs together."""
    from rigidimeter.analysis.study import condition_precisions
    from rigidimeter.core.records import PARAMETERS
    from rigidimeter.core.words import decimals, fixed

    for condition, each in condition_precisions(result).items():
        by_name = {one.measure.name: one for one in each}
        found: list[Precision] = [by_name[p.name] for p in PARAMETERS if p.name in by_name]
        if len(found) < len(PARAMETERS):
            continue
        cells = []
        for one, factor in zip(found, factors, strict=True):
            value, low, high = (factor * size for size in (one.value, one.low, one.high))
            places = decimals((high - low) / 2, value)
            interval = f"{fixed(low, places)} to {fixed(high, places)}"
            scatter = "–" if math.isnan(one.sd_percent) else f"{one.sd_percent:.2g} %"
            known = "–" if math.isnan(low) else interval
            cells.append((fixed(value, places), known, scatter))
        values, intervals, scatters = zip(*cells, strict=True)
        yield ""
        yield ("together", condition, *values, "", "")
        yield ("95 %", "", *intervals, "", "")
        yield ("SD", "", *scatters, "", "")


def _scores(result: StudyResult) -> Table:
    """Return the mean of the scores of each condition, per cycle."""
    from rigidimeter.analysis.study import condition_precisions
    from rigidimeter.core.words import number

    rows = []
    for condition, each in condition_precisions(result).items():
        found = {one.measure.short: one for one in each if one.measure.origin == "scores"}
        if found:
            cells = [
                f"{number(found[name].value, 3)} (SD {found[name].sd_percent:.2g} %)"
                if not math.isnan(found[name].sd_percent)
                else number(found[name].value, 3)
                for name in ("impulse", "work")
            ]
            rows.append((condition or "all", str(found["impulse"].n), *cells))
    return Table(("sinusoids", "epochs", "impulse, N·m·s", "work, J"), rows, "<>>>", 1)


def _method(analysis: Analysis) -> Iterator[tuple[str, str]]:
    """Yield why a method was chosen that the subject's own torque biases."""
    from rigidimeter.analysis.estimation import method_named, method_names

    known = analysis.fits and analysis.method in method_names()
    if known and not method_named(analysis.method).uses_perturbation:
        yield "method", f"{analysis.method}: {analysis.method_reason or 'as chosen'}"


def _excluded(analysis: Analysis) -> Iterator[tuple[str, str]]:
    """Yield which epochs do not count, and why."""
    why: dict[str, list[str]] = {}
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    for one in results:
        if not one.outcome.included:
            why.setdefault(f"{one.outcome.kind}: {one.outcome.reason}", []).append(one.epoch)
    for reason, epochs in list(why.items())[:MOST_NOTES]:
        kind, _, text = reason.partition(": ")
        first = epochs[0] if len(epochs) == 1 else f"{len(epochs)} epochs, first {epochs[0]}"
        yield kind, f"{first}: {text}"


def _short_scores(result: StudyResult) -> Iterator[tuple[str, str]]:
    """Yield that sinusoids were scored over fewer cycles than the settings say."""
    wanted, scores = result.settings.scores, result.analysis.scores
    short = [score.n_cycles for score in scores if 0 < score.n_cycles < wanted.cycles]
    if short:
        yield (
            "caution",
            f"{len(short)} of {len(scores)} sinusoids were scored over fewer than scores.cycles = "
            f"{wanted.cycles} cycles, the fewest {min(short)}: the motion less scores.discard_s = "
            f"{wanted.discard_s:g} s at each end holds no more",
        )


def _delays(analysis: Analysis) -> Iterator[tuple[str, str]]:
    """Yield how late the torque is in each source, where that is known."""
    for delay in analysis.delays[:MOST_NOTES]:
        late_s = abs(delay.delay_s)
        if math.isfinite(late_s):
            if not delay.corrected and late_s < SIGNIFICANT * delay.delay_s_se:
                continue
            done = "corrected" if delay.corrected else delay.remark
            side = "later" if delay.delay_s > 0 else "earlier"
            size = f"{1e3 * late_s:.3g} ± {1e3 * delay.delay_s_se:.2g} ms"
            yield "delay", f"torque {size} {side} than the motion in {delay.source}: {done}"
        elif delay.remark and any(fit.source == delay.source for fit in analysis.fits):
            yield "delay", f"{delay.source}: {delay.remark}"
