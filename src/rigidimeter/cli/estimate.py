"""`rigidimeter estimate`: J, B, K and scores of recordings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rigidimeter.cli.inputs import analyse_recordings, keep_inputs
from rigidimeter.cli.options import CsvOption, JsonOption, Recordings, reads_recordings
from rigidimeter.cli.output import echo
from rigidimeter.cli.table_lines import number_text, text_table, with_error, wrapped

if TYPE_CHECKING:
    from rigidimeter.records import Analysis, Fit, Score

_FIT_HEADING = ("epoch", "condition", "J kg·m²", "B N·m·s/rad", "K N·m/rad", "R²", "VAF %", "")
_DIGITS = (".5g", ".4g", ".4g")
_SCORE_HEADING = ("epoch", "condition", "impulse N·m·s", "work J", "")


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
    from rigidimeter.recording import write_estimates_csv, write_estimates_json
    from rigidimeter.study.subject_torque_table import check_name, write_subject_torque

    keep_inputs((json_out, csv_out, subject_torque_out), recordings.paths)
    if subject_torque_out is not None:
        check_name(subject_torque_out)
    read, analysis, status = analyse_recordings(recordings)
    if json_out is not None:
        write_estimates_json(json_out, analysis)
    if csv_out is not None:
        write_estimates_csv(csv_out, analysis)
    echo("\n".join(estimate_lines(analysis)))
    if subject_torque_out is not None:
        write_subject_torque(subject_torque_out, read, analysis)
    raise typer.Exit(status)


def estimate_lines(analysis: Analysis) -> list[str]:
    """Return everything that was estimated, with an empty line between blocks."""
    blocks = (_method, _delays, _fits, _fixed_inertia, _together, _findings, _scores)
    return [line for block in blocks if (lines := block(analysis)) for line in (*lines, "")][:-1]


def _together(analysis: Analysis) -> list[str]:
    """Return all epochs together; of one condition what the first screen of a report shows."""
    from rigidimeter.study import WANTED_PERCENT, compare_analysis, precisions

    found = precisions(compare_analysis(analysis, resamples=0))
    lines = []
    for one in found:
        text = f"  {one.measure.label}: {one.value:.5g} [{one.low:.5g} to {one.high:.5g}]"
        if one.epochs_needed is None:
            text = f"  {one.measure.label}: {one.value:.4g}, from one epoch, so without an interval"
        elif one.epochs_needed > one.n:
            text += f", ±{one.percent:.2g} %; ±{WANTED_PERCENT:g} % needs about "
            text += f"{one.epochs_needed} such epochs, not {one.n}"
        else:
            text += f", ±{one.percent:.2g} %"
        lines.append(text)
    return ["All epochs together, with 95 % intervals", *lines] if lines else _pooled(analysis)


def _method(analysis: Analysis) -> list[str]:
    if not analysis.method_reason:
        return []
    return wrapped(f"Method {analysis.method}: {analysis.method_reason}.")


def _delays(analysis: Analysis) -> list[str]:
    """Say how late the torque is in each source, where that is known."""
    lines = []
    for delay in analysis.delays:
        if math.isfinite(delay.delay_s):
            done = "corrected" if delay.corrected else delay.remark
            side = "later" if delay.delay_s > 0 else "earlier"
            text = (
                f"Torque {1e3 * abs(delay.delay_s):.3g} ± {1e3 * delay.delay_s_se:.2g} ms {side} "
                f"than the motion in {delay.source}: {done}."
            )
            lines += wrapped(text)
        elif delay.remark and any(fit.source == delay.source for fit in analysis.fits):
            lines += wrapped(f"{delay.source}: {delay.remark}.")
    return lines


def _fits(analysis: Analysis) -> list[str]:
    if not analysis.fits:
        return []
    bands = sorted({fit.band_hz for fit in analysis.fits if fit.n_samples})
    band = "".join(f", {low:.4g} to {high:.4g} Hz" for low, high in bands[:1])
    heading = f"J, B, K of each epoch ± one standard error, {analysis.method}{band}"
    return [heading, *_fit_table(analysis.fits, analysis.fits)]


def _fixed_inertia(analysis: Analysis) -> list[str]:
    if not analysis.fits:
        return []
    if not any(fit.outcome.included for fit in analysis.fits):
        return ["No epoch could be included, so there is no median inertia to hold."]
    inertia = f"{analysis.inertia_kg_m2:.5g} kg·m²"
    return [
        f"B, K with the inertia held at the median, {inertia}",
        *_fit_table(analysis.fixed_inertia, analysis.fits),
    ]


def _pooled(analysis: Analysis) -> list[str]:
    from rigidimeter.records import PARAMETERS

    rows = [
        (
            "" if i else fit.condition or "all",
            parameter.symbol,
            number_text(fit.value[i], ".5g"),
            "" if math.isnan(fit.low[i]) else f"[{fit.low[i]:.5g}, {fit.high[i]:.5g}]",
            parameter.unit,
        )
        for fit in analysis.pooled
        for i, parameter in enumerate(PARAMETERS)
    ]
    heading = "J, B, K of all epochs together, 95 % intervals"
    return [heading, *text_table(rows, "<<>><", "  ")] if rows else []


def _findings(analysis: Analysis) -> list[str]:
    """Return each kind of finding once: in which epochs, the first in full, and what to do."""
    lines = []
    for first, found_in in analysis.findings:
        fits = [fit for fit in found_in if fit.epoch != "pooled"]
        where = "all epochs together"
        if fits:
            count = "1 epoch" if len(fits) == 1 else f"{len(fits)} epochs"
            where = f"{count} of {len(analysis.fits)}, first epoch {fits[0].epoch}"
        lines += wrapped(
            f"{first.level}, {first.name}: {where}: {first.text}. Remedy: {first.remedy}.",
            " ",
        )
    return ["What the checks found (the JSON file has all of it)", *lines] if lines else []


def _fit_table(fits: Sequence[Fit], checked: Sequence[Fit]) -> list[str]:
    """Return a table with a line for each fit, and what casts doubt on its epoch."""
    rows = [
        (
            fit.epoch,
            fit.condition,
            *(
                with_error(value, se, digits)
                for value, se, digits in zip(fit.value, fit.se, _DIGITS, strict=True)
            ),
            number_text(fit.r_squared, ".4f"),
            number_text(fit.vaf_percent, ".2f"),
        )
        for fit in fits
    ]
    doubts = [f"doubt: {', '.join(fit.doubts)}" if fit.doubts else "" for fit in checked]
    return _by_source(fits, [_FIT_HEADING, *rows], "<<>>>>><", doubts)


def _scores(analysis: Analysis) -> list[str]:
    rows = [
        (
            score.epoch,
            score.condition,
            number_text(score.impulse_nm_s, ".5g"),
            number_text(score.work_j, ".5g"),
        )
        for score in analysis.scores
    ]
    if not rows:
        return []
    lines = _by_source(analysis.scores, [_SCORE_HEADING, *rows], "<<>><", [""] * len(rows))
    return ["Scores of each sinusoidal epoch, per cycle", *lines]


def _by_source(
    results: Sequence[Fit | Score],
    rows: Sequence[tuple[str, ...]],
    align: str,
    doubts: Sequence[str],
) -> list[str]:
    """Return a table of results by source; the last column says what is wrong with one."""
    remarks = [
        doubt if result.outcome.included else f"{result.outcome.kind}: {result.outcome.reason}"
        for result, doubt in zip(results, doubts, strict=True)
    ]
    heading, *lines = text_table(
        [rows[0], *((*row, remark) for row, remark in zip(rows[1:], remarks, strict=True))],
        align,
        "  ",
    )
    shown = [heading]
    for source, of_source in groupby(
        zip(results, lines, strict=True), key=lambda each: each[0].source
    ):
        shown += [f" {source}", *(line for _, line in of_source)]
    return shown
