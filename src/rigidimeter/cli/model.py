"""`rigidimeter model`: the torque as a sum of terms, and which terms it needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from rigidimeter.cli.help_pages import ESTIMATE
from rigidimeter.cli.inputs import keep_inputs, say
from rigidimeter.cli.options import JsonOption
from rigidimeter.cli.output import echo
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.cli.terminal_tables import Block, Heading, Table, show
from rigidimeter.core.errors import UserError
from rigidimeter.core.words import with_error

if TYPE_CHECKING:
    from rigidimeter.analysis.estimation.terms import Comparison, ModelRow
    from rigidimeter.analysis.study.torque_models import ModelledEpoch

USUAL = "inertia,damping,stiffness"
COMPARED = f"{USUAL},reflex,cubic,directional-damping,coulomb"
_HEADING = ("parameters", "VAF %", "held out, 95 %", "AIC", "BIC", "white p", "input p")


@reads_recordings
def model(
    recordings: Recordings,
    terms: Annotated[
        list[str] | None,
        typer.Option(
            "--terms",
            metavar="NAME,NAME,...",
            help="Terms of the torque, by their names. Repeat to compare your own models.",
            rich_help_panel=ESTIMATE,
        ),
    ] = None,
    compare: Annotated[
        bool,
        typer.Option(
            "--compare",
            help="Compare models, and recommend one. Each model predicts blocks of an epoch that "
            "it has not seen. With one --terms, J, B and K alone are tried, with each "
            "further term, and more beside the best as long as they predict better.",
            rich_help_panel=ESTIMATE,
        ),
    ] = False,
    json_out: JsonOption = None,
) -> None:
    """Fit the torque as a sum of terms, and find the terms it needs.

    Recordings are read as by `estimate`. A band from 0 Hz (--band-hz 0 40) keeps the mean of the
    torque, which offset and coulomb need. Each epoch passes the checks of `estimate` first. The
    exit status is 1 if any input was bad, or if no model is recommended for an epoch.

    \b
    For example:
      rigidimeter model ankle.csv --terms inertia,stiffness,reflex --compare
      rigidimeter model elbow.csv --terms inertia,stiffness,coulomb --band-hz 0 20
    """
    from rigidimeter.analysis.estimation.terms import candidates, parse_terms
    from rigidimeter.analysis.study.torque_models import model_document, model_recording
    from rigidimeter.cli.progress import Meter
    from rigidimeter.core.files import write_json

    if recordings.method not in ("auto", "bandlimited"):
        raise UserError(
            f"--method {recordings.method}: terms are fitted only with bandlimited; leave it out"
        )
    named = [parse_terms(text) for text in terms or [COMPARED if compare else USUAL]]
    grow = compare and len(named) == 1
    models = candidates(named[0]) if grow else named
    band_hz = recordings.band_hz
    if band_hz is not None and band_hz[0] == 0:
        if not band_hz[1] > 0:
            raise UserError(f"--band-hz 0 {band_hz[1]:g}: the upper edge must be above 0 Hz")
        # The settings refuse a band from 0 Hz, because the other methods need its lower edge.
        recordings = replace(recordings, band_hz=None)
        high_hz: float | None = band_hz[1]
    else:
        high_hz = None
    keep_inputs((json_out,), recordings.paths)
    read = recordings.read()
    say(read.notices)
    with Meter("model", 1.0, from_first=True) as meter:
        found = model_recording(
            read, models, compare=compare, grow=grow, high_hz=high_hz, progress=meter.advance
        )
    for each in found:
        problems = () if compare else each.unfitted
        for problem in problems or ((each.problem,) if each.problem else ()):
            echo(f"error: {each.epoch.name}: {problem}", err=True)
    if json_out is not None:
        write_json(json_out, model_document(found))
    for place, each in enumerate(found):
        show([*([""] if place else []), *_blocks(each)])
    raise typer.Exit(int(read.failed or any(each.failed for each in found)))


def _blocks(found: ModelledEpoch) -> list[Block]:
    if found.models is None:
        return [f"{found.epoch.name}: failed, {found.problem}"]
    low, high = found.models.band_hz
    compared = found.models.compared
    heading: list[Block] = [Heading(f"{found.epoch.name}, {low:.4g} to {high:.4g} Hz")]
    if found.clock:
        heading.append(f"  {found.clock}")
    findings = [f"  {one.level}  {one.name}  {one.headline}" for one in found.models.findings]
    if not found.compared:
        fits = (block for row in compared.rows for block in _fit_blocks(row))
        return [*heading, *fits, *findings]
    recommended = compared.recommended
    shown = _fit_blocks(recommended) if recommended is not None else []
    return [*heading, *_table(compared), *shown, *findings]


def _table(compared: Comparison) -> list[Block]:
    rows: list[Sequence[str] | str] = []
    for row in compared.rows:
        if row.fit is None:
            rows.append(f"  {row.name}: {row.problem}")
            continue
        fit = row.fit
        rows.append(f"{'*' if row is compared.recommended else ' '} {row.name}")
        rows.append(
            (
                f"{fit.n_parameters}",
                f"{fit.vaf_percent:.2f}",
                _held_out(row),
                f"{fit.aic:.1f}",
                f"{fit.bic:.1f}",
                f"{fit.test.ljung_box_p:.2g}",
                f"{fit.test.input_p:.2g}",
            )
        )
    pushing = [f"  {row.name}: {row.problem}" for row in compared.rows if row.fit and row.problem]
    verdict = "no model is recommended" if compared.recommended is None else "recommended"
    table = Table(_HEADING, rows, ">>=>>>>")
    return [table, *pushing, f"  {verdict}: {compared.reason}"]


def _held_out(row: ModelRow) -> str:
    if row.held_out is None:
        return ""
    return "{:.2f} [{:.2f}, {:.2f}]".format(*row.held_out)


def _fit_blocks(row: ModelRow) -> list[Block]:
    if row.fit is None:
        return [f"  {'+'.join(row.terms)}: {row.problem}"]
    fit = row.fit
    rows = [
        (
            f"{one.term} {one.name}".strip(),
            with_error(one.value, one.standard_error),
            one.unit,
        )
        for one in fit.parameters
        if not one.name.startswith("response")
    ]
    return [
        f"  {'+'.join(row.terms)}, VAF {fit.vaf_percent:.2f} %",
        Table(("", "", "unit"), rows, "<>=", indent=4),
        *(f"    {remark}" for remark in fit.remarks),
        *(
            f"    {one.term} from what no linear loop explains: "
            f"{with_error(one.value, one.standard_error)} {one.unit}"
            for one in row.beyond
        ),
    ]
