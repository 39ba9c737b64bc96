"""`rigidimeter model`: which terms a joint's torque is made of."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rigidimeter.cli.inputs import Recordings, keep_inputs, say
from rigidimeter.cli.options import reads_recordings
from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.estimation.terms import Comparison, ModelRow, TermsFit
    from rigidimeter.records import Epoch
    from rigidimeter.settings import Settings

__all__ = ["model"]

MODEL_SCHEMA = "rigidimeter.model/1"
USUAL = "inertia,damping,stiffness"
COMPARED = f"{USUAL},reflex,cubic,directional-damping,coulomb"


@reads_recordings
def model(
    recordings: Recordings,
    terms: Annotated[
        list[str] | None,
        typer.Option(
            "--terms",
            metavar="NAME,NAME,...",
            help="Terms of the torque: inertia, damping, stiffness, offset, coulomb, quadratic, "
            "cubic, directional-damping, directional-stiffness, directional-coulomb, reflex, "
            "reflex-fir, reflex-second-order (+ or - after a reflex: the direction that stretches "
            "the muscle). Repeat to compare your own models.",
        ),
    ] = None,
    compare: Annotated[
        bool,
        typer.Option(
            "--compare",
            help="Fit each model to the first half of an epoch, judge it on the second, and "
            "recommend one. With one --terms, each of its further terms is tried by itself.",
        ),
    ] = False,
    json_out: Annotated[
        Path | None, typer.Option("--json", metavar="OUT", help="Write everything as JSON.")
    ] = None,
) -> None:
    """Fit the torque as a sum of terms by name, and find which terms it needs.

    Recordings are read as by `estimate`. A band from 0 Hz (--band-hz 0 40) keeps the mean of the
    torque, which offset and coulomb need. The exit status is 1 if any input was bad.

    \b
    For example:
      rigidimeter model demo-study/sessions/day-1
      rigidimeter model ankle.npz --column angle_rad=position_rad --column torque_nm=torque_Nm \\
          --reaction --terms inertia,damping,stiffness,reflex --compare
      rigidimeter model elbow.csv --terms inertia,damping,stiffness,offset,coulomb --band-hz 0 20
    """
    from rigidimeter.documents import write_json
    from rigidimeter.estimation import aligned, estimate_delays
    from rigidimeter.estimation.terms import candidates, parse_terms
    from rigidimeter.study import task_of

    if recordings.method not in ("auto", "bandlimited"):
        raise UserError(
            f"--method {recordings.method}: terms are fitted only with bandlimited; leave it out"
        )
    named = [parse_terms(text) for text in terms or [COMPARED if compare else USUAL]]
    models = candidates(named[0]) if compare and len(named) == 1 else named
    band_hz = recordings.band_hz
    if band_hz is not None and band_hz[0] == 0:
        if not band_hz[1] > 0:
            raise UserError(f"--band-hz 0 {band_hz[1]:g}: the upper edge must be above 0 Hz")
        # The settings know no band from 0 Hz, since the other methods cannot do without its edge.
        recordings = replace(recordings, band_hz=None)
    else:
        band_hz = None
    keep_inputs((json_out,), recordings.paths)
    read = recordings.read()
    say(read.notices)
    bad = read.failed
    rows: list[dict[str, Any]] = []
    lines: list[str] = []
    perturbed = [e for e in read.epochs if task_of(e, read.settings) != "sinusoid"]
    by_source: dict[str, list[Epoch]] = {}
    for epoch in perturbed:
        by_source.setdefault(epoch.source, []).append(epoch)
    delays = estimate_delays(by_source, read.settings)
    for epoch in perturbed:
        row, text, failed = _epoch(aligned(epoch, delays), read.settings, models, compare, band_hz)
        rows.append(row)
        lines += [*text, ""]
        bad = bad or failed
    if not rows:
        raise UserError("every epoch is an imposed sinusoid; a model needs a perturbed one")
    if json_out is not None:
        write_json(json_out, {"schema": MODEL_SCHEMA, "compared": compare, "epochs": rows})
    typer.echo("\n".join(lines).rstrip())
    raise typer.Exit(int(bad))


def _epoch(
    epoch: Epoch,
    every_setting: Settings,
    models: Sequence[tuple[str, ...]],
    compare: bool,
    wanted_band_hz: tuple[float, float] | None,
) -> tuple[dict[str, Any], list[str], bool]:
    """Return what to write of an epoch, what to print, and whether it failed."""
    from rigidimeter.estimation import band_hz
    from rigidimeter.estimation.screening import USABLE_FRACTION_OF_RATE, before_fit
    from rigidimeter.estimation.signals import motion_channels
    from rigidimeter.estimation.terms import ModelRow, compare_models, fit_terms, motion_from_epoch

    settings = every_setting.estimation
    row: dict[str, Any] = {
        "source": epoch.source,
        "epoch": epoch.label,
        "condition": epoch.condition,
    }
    obstacle = before_fit(epoch, settings)
    if obstacle:
        typer.echo(f"error: {epoch.name}: {obstacle}", err=True)
        failed = {"outcome": "failed", "reason": obstacle, "models": []}
        return row | failed, [f"{epoch.name}: failed, {obstacle}"], True
    low, high = band_hz(epoch, settings)
    band = (low, high)
    if wanted_band_hz is not None:
        used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
        usable = USABLE_FRACTION_OF_RATE * min(one.rate_hz for one in used)
        band = (0.0, min(wanted_band_hz[1], usable))
    motion = motion_from_epoch(epoch, band[1])
    row |= {"outcome": epoch.closed.kind, "reason": epoch.closed.reason, "band_hz": list(band)}
    lines = [f"{epoch.name}, {band[0]:.4g} to {band[1]:.4g} Hz"]
    if compare:
        compared = compare_models(motion, models, band, settings.trim_s)
        pushes = _pushes(epoch, every_setting)
        if pushes:
            compared = replace(compared, recommended=None, reason=pushes)
        lines += _table(compared)
        row["recommended"] = compared.recommended and list(compared.recommended.terms)
        row["why"] = compared.reason
        found = compared.rows
        chosen = [compared.recommended] if compared.recommended else []
    else:
        found = tuple(_fitted(fit_terms, motion, one, band, settings.trim_s) for one in models)
        chosen = [one for one in found if isinstance(one, ModelRow)]
    row["models"] = [_as_json(one) for one in found]
    for one in chosen:
        lines += _fit_lines(one)
    problems = [one.problem for one in found if one.fit is None]
    if not compare:
        for problem in problems:
            typer.echo(f"error: {epoch.name}: {problem}", err=True)
    return row, lines, bool(problems) and (not compare or len(problems) == len(found))


def _pushes(epoch: Epoch, settings: Settings) -> str:
    """Return why held-out data cannot choose a model, or an empty text.

    In the closed loop the subject's own torque is in the motion in both halves alike, so a term
    that fits it predicts it too, and says nothing of the joint.
    """
    from rigidimeter.estimation import epoch_signals, fit_epochs
    from rigidimeter.estimation.diagnostics import reconstructed_torque_nm, voluntary_torque

    if "perturbation_nm" not in epoch.channels:
        return ""
    (fit,), _ = fit_epochs([epoch], "iv", settings)
    if fit.n_samples == 0:
        return ""
    signals = epoch_signals(epoch, "bandlimited", settings.estimation)
    parameters = (fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad)
    own_nm = reconstructed_torque_nm(signals, parameters)
    finding = voluntary_torque(own_nm, signals, settings.diagnostics)
    if not finding.remedy:
        return ""
    return (
        f"{finding.value:.2g} % of the torque's variance is the subject's own, which the loop puts "
        "into the motion too; a term that fits it predicts it in both halves and says nothing of "
        "the joint"
    )


def _fitted(fit_terms: Any, motion: Any, terms: Any, band: Any, trim_s: float) -> ModelRow:
    from rigidimeter.estimation.terms import ModelRow

    try:
        fit = fit_terms(motion, terms, band, trim_s)
    except ValueError as error:
        return ModelRow(terms, None, math.nan, str(error))
    return ModelRow(fit.terms, fit, math.nan)


def _table(compared: Comparison) -> list[str]:
    lines = [
        f"  {'parameters':>10} {'VAF %':>7} {'held out':>8} {'AIC':>9} {'BIC':>9} "
        f"{'white p':>8} {'input p':>8}  model"
    ]
    for row in compared.rows:
        name = "+".join(row.terms)
        if row.fit is None:
            lines.append(
                f"  {'':>10} {'':>7} {'':>8} {'':>9} {'':>9} {'':>8} {'':>8}  {name}: {row.problem}"
            )
            continue
        fit = row.fit
        mark = "* " if row is compared.recommended else "  "
        lines.append(
            f"{mark}{fit.n_parameters:>10} {fit.vaf_percent:7.2f} {row.held_out_vaf_percent:8.2f} "
            f"{fit.aic:9.1f} {fit.bic:9.1f} {fit.test.ljung_box_p:8.2g} {fit.test.input_p:8.2g}  "
            f"{name}"
        )
    if compared.recommended is None:
        return [*lines, f"  none is recommended: {compared.reason}"]
    return [*lines, f"  recommended: {compared.reason}"]


def _fit_lines(row: ModelRow) -> list[str]:
    if row.fit is None:
        return [f"  {'+'.join(row.terms)}: {row.problem}"]
    fit = row.fit
    lines = [f"  {'+'.join(row.terms)}, VAF {fit.vaf_percent:.2f} %"]
    for one in fit.parameters:
        if not one.name.startswith("response"):
            name = f"{one.term} {one.name}".strip()
            lines.append(f"    {name:<38} {one.value:11.5g} ±{one.standard_error:8.2g} {one.unit}")
    return [*lines, *(f"    {remark}" for remark in fit.remarks)]


def _as_json(row: ModelRow) -> dict[str, Any]:
    return {
        "terms": list(row.terms),
        "problem": row.problem,
        "held_out_vaf_percent": _finite(row.held_out_vaf_percent),
        **(_fit_json(row.fit) if row.fit is not None else {}),
    }


def _fit_json(fit: TermsFit) -> dict[str, Any]:
    return {
        "parameters": [
            {
                "term": one.term,
                "name": one.name,
                "value": one.value,
                "standard_error": _finite(one.standard_error),
                "unit": one.unit,
            }
            for one in fit.parameters
        ],
        "n_parameters": fit.n_parameters,
        "vaf_percent": fit.vaf_percent,
        "aic": fit.aic,
        "bic": fit.bic,
        "independent_samples": fit.independent_samples,
        "condition_number": fit.condition_number,
        "ljung_box_p": fit.test.ljung_box_p,
        "input_correlation": fit.test.input_correlation,
        "input_p": fit.test.input_p,
        "remarks": list(fit.remarks),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
