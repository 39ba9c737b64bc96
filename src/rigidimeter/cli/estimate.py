"""`rigidimeter estimate`: J, B, K and scores of recordings."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from rigidimeter.cli.inputs import analyse_inputs, keep_inputs, say, status
from rigidimeter.cli.options import Recordings, reads_recordings

if TYPE_CHECKING:
    from rigidimeter.records import Analysis, Fit, Outcome, Score

__all__ = ["estimate"]

_R = TypeVar("_R", "Fit", "Score")


@reads_recordings
def estimate(
    recordings: Recordings,
    json_out: Annotated[
        Path | None, typer.Option("--json", metavar="OUT", help="Write everything as JSON.")
    ] = None,
    csv_out: Annotated[
        Path | None, typer.Option("--csv", metavar="OUT", help="Write the epoch table as CSV.")
    ] = None,
) -> None:
    """Estimate inertia J, damping B and stiffness K of each epoch, and score the sinusoids.

    A file holds time_s, torque_nm, at least one of velocity_rad_s and angle_rad, and optionally
    velocity_command_rad_s, perturbation_nm, epoch, condition and task. Torque is positive when it
    drives the joint toward positive angle. The exit status is 1 if any input was bad; the rest is
    analysed all the same.

    \b
    For example:
      rigidimeter estimate demo-study/sessions/day-1
      rigidimeter estimate elbow.csv --epoch-length-s 20 --json estimates.json
      rigidimeter estimate ankle.npz --column angle_rad=position_rad \\
          --column torque_nm=torque_Nm --rate-hz 1000 --reaction --epoch-length-s 20
    """
    from rigidimeter.recording import write_estimates_csv, write_estimates_json

    keep_inputs((json_out, csv_out), recordings.paths)
    read = recordings.read()
    say(read.notices)
    analysis = analyse_inputs(read, recordings.method)
    if json_out is not None:
        write_estimates_json(json_out, analysis)
    if csv_out is not None:
        write_estimates_csv(csv_out, analysis)
    typer.echo("\n".join(_lines(analysis)))
    raise typer.Exit(status(read, analysis))


def _lines(analysis: Analysis) -> list[str]:
    lines: list[str] = []
    if analysis.method_reason:
        lines += [*_wrapped(f"Method {analysis.method}: {analysis.method_reason}."), ""]
    lines += _delay_lines(analysis)
    if analysis.fits:
        lines += [
            f"J, B, K of each epoch ± one standard error, {analysis.method}{_band(analysis)}",
            *_by_source(analysis.fits, _FIT_HEADING, _fit_line),
            "",
        ]
        if any(fit.outcome.included for fit in analysis.fits):
            lines += [
                f"B, K with the inertia held at the median, {analysis.inertia_kg_m2:.5g} kg·m²",
                *_by_source(analysis.fixed_inertia, _FIT_HEADING, _fit_line),
            ]
        else:
            lines.append("No epoch could be included, so there is no median inertia to hold.")
        if analysis.pooled:
            lines += ["", "J, B, K of all epochs together, 95 % intervals"]
            lines += [line for fit in analysis.pooled for line in _pooled_lines(fit)]
        lines += _finding_lines(analysis)
    if analysis.scores:
        lines += [
            *([""] if lines else []),
            "Scores of each sinusoidal epoch, per cycle",
            *_by_source(analysis.scores, _SCORE_HEADING, _score_line),
        ]
    return lines


def _wrapped(text: str, indent: str = "") -> list[str]:
    return textwrap.wrap(text, 100, subsequent_indent=indent + "  ", initial_indent=indent)


def _delay_lines(analysis: Analysis) -> list[str]:
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
            lines += _wrapped(text)
        elif delay.remark and any(fit.source == delay.source for fit in analysis.fits):
            lines += _wrapped(f"{delay.source}: {delay.remark}.")
    return [*lines, ""] if lines else []


def _pooled_lines(fit: Fit) -> list[str]:
    from rigidimeter.records import PARAMETERS

    name = (fit.condition or "all")[:10]
    return [
        f"{'' if i else name:>10} {parameter.symbol} {fit.value[i]:11.5g}  "
        f"[{fit.low[i]:.5g}, {fit.high[i]:.5g}] {parameter.unit}"
        for i, parameter in enumerate(PARAMETERS)
    ]


def _finding_lines(analysis: Analysis) -> list[str]:
    """Return each kind of finding once: in which epochs, the first in full, and what to do."""
    lines = []
    for first, found_in in analysis.findings:
        fits = [fit for fit in found_in if fit.epoch != "pooled"]
        if not fits:
            continue
        where = "1 epoch" if len(fits) == 1 else f"{len(fits)} epochs"
        lines += _wrapped(
            f"{first.level}: {where} of {len(analysis.fits)}, first epoch {fits[0].epoch}: "
            f"{first.text}. Remedy: {first.remedy}.",
            indent=" ",
        )
    return ["", "What the checks found (all of it is in the JSON)", *lines] if lines else []


def _band(analysis: Analysis) -> str:
    bands = {fit.band_hz for fit in analysis.fits if fit.n_samples}
    return "".join(f", {low:.4g} to {high:.4g} Hz" for low, high in sorted(bands)[:1])


_FIT_HEADING = (
    f"{'epoch':>10} {'condition':>10} {'J kg·m²':>21} {'B N·m·s/rad':>19} {'K N·m/rad':>19} "
    f"{'R²':>8} {'VAF %':>7}"
)
_SCORE_HEADING = f"{'epoch':>10} {'condition':>10} {'impulse N·m·s':>14} {'work J':>10}"


def _by_source(results: Sequence[_R], heading: str, line: Callable[[_R], str]) -> list[str]:
    """Return a table with a line for each result, under the name of its source."""
    lines = [heading]
    source = None
    for result in results:
        if result.source != source:
            source = result.source
            lines.append(f" {source}")
        lines.append(line(result))
    return lines


def _fit_line(fit: Fit) -> str:
    return (
        f"{fit.epoch[-10:]:>10} {fit.condition[:10]:>10} "
        f"{fit.inertia_kg_m2:11.5g} ±{fit.inertia_kg_m2_se:8.2g} "
        f"{fit.damping_nm_s_rad:9.4g} ±{fit.damping_nm_s_rad_se:8.2g} "
        f"{fit.stiffness_nm_rad:9.4g} ±{fit.stiffness_nm_rad_se:8.2g} "
        f"{fit.r_squared:8.4f} {fit.vaf_percent:7.2f}{_remark(fit.outcome)}"
    )


def _score_line(score: Score) -> str:
    return (
        f"{score.epoch[-10:]:>10} {score.condition[:10]:>10} {score.impulse_nm_s:14.5g} "
        f"{score.work_j:10.5g}{_remark(score.outcome)}"
    )


def _remark(outcome: Outcome) -> str:
    return "" if outcome.included else f"  {outcome.kind}: {outcome.reason}"
