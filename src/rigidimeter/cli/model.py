"""`rigidimeter model`: which terms a joint's torque is made of."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rigidimeter.cli.inputs import keep_inputs, say
from rigidimeter.cli.options import JsonOption, Recordings, reads_recordings
from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.estimation.terms import Comparison, EpochModels, ModelRow, TermsFit
    from rigidimeter.records import Epoch

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
            help="The terms of the torque, by their names. Repeat to compare your own models.",
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
    json_out: JsonOption = None,
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
    from rigidimeter.estimation.terms import candidates, model_epoch, parse_terms
    from rigidimeter.study import Preparation

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
        high_hz: float | None = band_hz[1]
    else:
        high_hz = None
    keep_inputs((json_out,), recordings.paths)
    read = recordings.read()
    say(read.notices)
    bad = read.failed
    rows: list[dict[str, Any]] = []
    lines: list[str] = []
    for prepared in Preparation(read.epochs, read.settings).perturbed():
        epoch = prepared.epoch
        row: dict[str, Any] = {
            "source": epoch.source,
            "epoch": epoch.label,
            "condition": epoch.condition,
        }
        try:
            found = model_epoch(epoch, models, read.settings, compare=compare, high_hz=high_hz)
        except ValueError as error:
            typer.echo(f"error: {epoch.name}: {error}", err=True)
            rows.append(row | {"outcome": "failed", "reason": str(error), "models": []})
            lines += [f"{epoch.name}: failed, {error}", ""]
            bad = True
            continue
        rows.append(row | _as_json(epoch, found, compare))
        lines += [*_lines(epoch, found, compare), ""]
        problems = [one.problem for one in found.compared.rows if one.fit is None]
        if not compare:
            for problem in problems:
                typer.echo(f"error: {epoch.name}: {problem}", err=True)
        bad = bad or len(problems) == len(models) or (bool(problems) and not compare)
    if not rows:
        raise UserError("every epoch is an imposed sinusoid; a model needs a perturbed one")
    if json_out is not None:
        write_json(json_out, {"schema": MODEL_SCHEMA, "compared": compare, "epochs": rows})
    typer.echo("\n".join(lines).rstrip())
    raise typer.Exit(int(bad))


def _lines(epoch: Epoch, found: EpochModels, compare: bool) -> list[str]:
    low, high = found.band_hz
    heading = f"{epoch.name}, {low:.4g} to {high:.4g} Hz"
    if not compare:
        return [heading, *(line for row in found.compared.rows for line in _fit_lines(row))]
    recommended = found.compared.recommended
    shown = _fit_lines(recommended) if recommended is not None else []
    return [heading, *_table(found.compared), *shown]


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


def _as_json(epoch: Epoch, found: EpochModels, compare: bool) -> dict[str, Any]:
    chosen = found.compared.recommended
    return {
        "outcome": epoch.closed.kind,
        "reason": epoch.closed.reason,
        "band_hz": list(found.band_hz),
        **({"recommended": chosen and list(chosen.terms)} if compare else {}),
        **({"why": found.compared.reason} if compare else {}),
        "models": [
            {
                "terms": list(row.terms),
                "problem": row.problem,
                "held_out_vaf_percent": row.held_out_vaf_percent,
                **(_fit_json(row.fit) if row.fit is not None else {}),
            }
            for row in found.compared.rows
        ],
    }


def _fit_json(fit: TermsFit) -> dict[str, Any]:
    return {
        "parameters": [vars(one) for one in fit.parameters],
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
