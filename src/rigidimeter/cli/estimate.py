"""`rigidimeter estimate`: J, B, K and scores of recordings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rigidimeter.cli.inputs import analyse_recordings, keep_inputs, say_analysed
from rigidimeter.cli.options import CsvOption, JsonOption
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.cli.terminal_tables import Block, Heading, Table, number_text, show
from rigidimeter.core.text import with_error

if TYPE_CHECKING:
    from rigidimeter.analysis.study import StudyResult
    from rigidimeter.core.records import Analysis, Fit, Score
    from rigidimeter.core.settings import ScoreSettings


@reads_recordings
def estimate(
    recordings: Recordings,
    json_out: JsonOption = None,
    csv_out: CsvOption = None,
    subject_torque_out: Annotated[
        Path | None,
        typer.Option(
            "--subject-torque",
            metavar="FILE",
            help="Write measured, joint and subject's torque of each epoch, as .csv or .parquet.",
        ),
    ] = None,
) -> None:
    """Estimate inertia J, damping B and stiffness K of each epoch, and score the sinusoids.

    A file holds time_s, torque_nm, at least one of velocity_rad_s and angle_rad, and optionally
    velocity_command_rad_s, perturbation_nm, epoch, condition and task. Torque is positive when it
    drives the joint toward positive angles. The exit status is 1 if any input was bad; the others
    are still analysed.

    \b
    For example:
      rigidimeter estimate demo-study/sessions/day-1
      rigidimeter estimate elbow.csv --epoch-length-s 20 --json estimates.json
      rigidimeter estimate ankle.npz --column angle_rad=position_rad \\
          --column torque_nm=torque_Nm --rate-hz 1000 --reaction --epoch-length-s 20
    """
    from rigidimeter.analysis.reading import write_estimates_csv, write_estimates_json
    from rigidimeter.analysis.study import recording_result
    from rigidimeter.analysis.study.subject_torque_table import check_name, write_subject_torque

    keep_inputs((json_out, csv_out, subject_torque_out), recordings.paths)
    if subject_torque_out is not None:
        check_name(subject_torque_out)
    read, analysis = analyse_recordings(recordings)
    try:
        if json_out is not None:
            write_estimates_json(json_out, analysis)
        if csv_out is not None:
            write_estimates_csv(csv_out, analysis)
        show(estimate_blocks(recording_result(read, analysis)))
        if subject_torque_out is not None:
            write_subject_torque(subject_torque_out, read, analysis)
    finally:
        status = say_analysed(read, analysis)
    raise typer.Exit(status)


def estimate_blocks(result: StudyResult) -> list[Block]:
    """Return the verdict and everything that was estimated, with an empty line between parts."""
    from rigidimeter.analysis.report.verdict_text import verdict

    parts: list[Sequence[Block]] = [[Heading(verdict(result).lead)]]
    parts += [part(result.analysis) for part in (_method, _delays, _fits, _fixed_inertia)]
    parts.append(_together(result) or _pooled(result))
    parts += [_findings(result.analysis), _scores(result.analysis.scores, result.settings.scores)]
    return [block for part in parts if part for block in (*part, "")][:-1]


def _together(result: StudyResult) -> list[Block]:
    """Return of one condition what the first screen of a report shows."""
    from rigidimeter.analysis.report.numbers import scaled
    from rigidimeter.analysis.study import WANTED_PERCENT, precisions

    rows = []
    for one in precisions(result):
        factor, unit = scaled(one.value, one.measure.unit)
        ends = ("not known from one epoch", "")
        if one.epochs_needed is not None:
            ends = f"{factor * one.low:.5g} to {factor * one.high:.5g}", f"±{one.percent:.2g} %"
        needed = "" if one.epochs_needed is None else f"{one.epochs_needed}"
        rows.append(
            (
                *(f"{one.measure.title}, {unit}", f"{factor * one.value:.5g}", *ends),
                *(number_text(one.sd_percent, ".2g"), f"{one.n}", needed),
            )
        )
    if not rows:
        return []
    headings = (
        *("", "estimate", "95 % interval", "", "SD between\nepochs, %", "epochs"),
        f"needed for\n±{WANTED_PERCENT:g} %",
    )
    return [Heading("All epochs together"), Table(headings, rows, "<>=>>>>")]


def _method(analysis: Analysis) -> list[Block]:
    return (
        [f"Method {analysis.method}: {analysis.method_reason}."] if analysis.method_reason else []
    )


def _delays(analysis: Analysis) -> list[Block]:
    """Say how late the torque is in each source, where that is known."""
    lines: list[Block] = []
    for delay in analysis.delays:
        if math.isfinite(delay.delay_s):
            done = "corrected" if delay.corrected else delay.remark
            side = "later" if delay.delay_s > 0 else "earlier"
            lines.append(
                f"Torque {with_error(1e3 * abs(delay.delay_s), 1e3 * delay.delay_s_se)} ms {side} "
                f"than the motion in {delay.source}: {done}."
            )
        elif delay.remark and any(fit.source == delay.source for fit in analysis.fits):
            lines.append(f"{delay.source}: {delay.remark}.")
    return lines


def _fits(analysis: Analysis) -> list[Block]:
    if not analysis.fits:
        return []
    bands = sorted({fit.band_hz for fit in analysis.fits if fit.n_samples})
    band = "".join(f", {low:.4g} to {high:.4g} Hz" for low, high in bands[:1])
    heading = f"J, B, K of each epoch ± one standard error, {analysis.method}{band}"
    table = _fit_table(analysis.fits, analysis.fits)
    return [Heading(heading), table, f"{analysis.weight_in_stiffness}."]


def _fixed_inertia(analysis: Analysis) -> list[Block]:
    from rigidimeter.analysis.report.numbers import amount

    if not analysis.fits:
        return []
    if not any(fit.outcome.included for fit in analysis.fits):
        return ["No epoch could be included, so there is no median inertia to hold."]
    inertia = amount(analysis.inertia_kg_m2, "kg·m²", 5)
    return [
        Heading(f"B, K with the inertia held at the median, {inertia}"),
        _fit_table(analysis.fixed_inertia, analysis.fits, first=1),
    ]


def _pooled(result: StudyResult) -> list[Block]:
    from rigidimeter.analysis.study import split_pooled
    from rigidimeter.core.records import PARAMETERS

    def sd(condition: str, measure: str) -> str:
        c = result.comparison(measure)
        known = None if c is None else c.summaries.get(condition)
        return "" if known is None else number_text(known.sd_percent, ".2g")

    of_each, overall = split_pooled(result.analysis)
    fits = [of_each[name] for name in result.condition_names if name in of_each]
    rows = [
        (
            "" if i else fit.condition or "all",
            parameter.symbol,
            number_text(fit.value[i], ".5g"),
            "" if math.isnan(fit.low[i]) else f"[{fit.low[i]:.5g}, {fit.high[i]:.5g}]",
            parameter.unit,
            sd(fit.condition, parameter.name),
        )
        for fit in (*fits, *([] if overall is None else [overall]))
        for i, parameter in enumerate(PARAMETERS)
    ]
    headings = ("condition", "", "estimate", "95 % interval", "unit", "SD between\nepochs, %")
    return [Heading("All epochs together"), Table(headings, rows, "<<>>=>")] if rows else []


def _findings(analysis: Analysis) -> list[Block]:
    """Return each kind of finding once: in which epochs, the first in full, and what to do."""
    lines: list[Block] = []
    for first, found_in in analysis.findings:
        fits = [fit for fit in found_in if fit.epoch != "pooled"]
        where = "all epochs together"
        if fits:
            count = "1 epoch" if len(fits) == 1 else f"{len(fits)} epochs"
            where = f"{count} of {len(analysis.fits)}, first epoch {fits[0].epoch}"
        lines.append(
            f"  {first.level}, {first.name}: {where}: {first.text}. Remedy: {first.remedy}."
        )
    return [Heading("What the checks found (the JSON file has all of it)"), *lines] if lines else []


def _fit_table(fits: Sequence[Fit], checked: Sequence[Fit], first: int = 0) -> Table:
    """Return a table with a row for each fit, and what casts doubt on its epoch.

    `first` is the first of J, B and K that is shown.
    """
    from rigidimeter.analysis.report.numbers import scaled
    from rigidimeter.core.records import PARAMETERS

    shown = range(first, len(PARAMETERS))
    scales = {
        i: scaled(max((abs(fit.value[i]) for fit in fits), default=0.0), PARAMETERS[i].unit)
        for i in shown
    }
    headings = [f"{PARAMETERS[i].symbol}\n{unit}" for i, (_, unit) in scales.items()]
    rows = [
        (
            fit.epoch,
            fit.condition,
            *(
                with_error(factor * fit.value[i], factor * fit.se[i])
                for i, (factor, _) in scales.items()
            ),
            number_text(fit.vaf_percent, ".2f"),
        )
        for fit in fits
    ]
    doubts = [f"doubt: {', '.join(fit.doubts)}" if fit.doubts else "" for fit in checked]
    return Table(
        ("epoch", "condition", *headings, "VAF\n%"),
        _by_source(fits, rows, doubts),
        "<<" + ">" * (len(shown) + 1),
    )


def _scores(scores: Sequence[Score], wanted: ScoreSettings) -> list[Block]:
    rows = [
        (
            score.epoch,
            score.condition,
            number_text(score.impulse_nm_s, ".5g"),
            number_text(score.work_j, ".5g"),
            f"{score.n_cycles or ''}",
        )
        for score in scores
    ]
    if not rows:
        return []
    headings = ("epoch", "condition", "impulse\nN·m·s", "work\nJ", "cycles")
    table = Table(headings, _by_source(scores, rows, [""] * len(rows)), "<<>>>")
    remarks = []
    if short := [score.n_cycles for score in scores if 0 < score.n_cycles < wanted.cycles]:
        remarks = [
            f"Warning: {len(short)} of {len(scores)} epochs were scored over fewer than "
            f"scores.cycles = {wanted.cycles} cycles, the fewest {min(short)}: the motion less "
            f"scores.discard_s = {wanted.discard_s:g} s at each end holds no more."
        ]
    return [Heading("Scores of each sinusoidal epoch, per cycle"), table, *remarks]


def _by_source(
    results: Sequence[Fit | Score], rows: Sequence[tuple[str, ...]], doubts: Sequence[str]
) -> list[Sequence[str] | str]:
    """Return rows below the name of their source, and below a row what is wrong with it."""
    shown: list[Sequence[str] | str] = []
    for source, of_source in groupby(
        zip(results, rows, doubts, strict=True), key=lambda each: each[0].source
    ):
        shown.append(source)
        for result, row, doubt in of_source:
            outcome = result.outcome
            remark = doubt if outcome.included else f"{outcome.kind}: {outcome.reason}"
            shown += [row, f"    {remark}"] if remark else [row]
    return shown
