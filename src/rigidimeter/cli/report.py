"""`rigidimeter report`: one page from recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.cli.inputs import analyse_inputs, read_inputs, say, status
from rigidimeter.cli.options import (
    BandOption,
    ColumnOption,
    ConditionOption,
    EpochLengthOption,
    InputsArgument,
    MethodOption,
    RateOption,
    ReactionOption,
    SettingsOption,
    TaskOption,
)

__all__ = ["report"]


def report(
    inputs: InputsArgument,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the report.")],
    title: Annotated[
        str, typer.Option("--title", metavar="TEXT", help="Title of the page.")
    ] = "Joint rigidity",
    method: MethodOption = "bandlimited",
    column: ColumnOption = None,
    rate_hz: RateOption = None,
    reaction: ReactionOption = False,
    epoch_length_s: EpochLengthOption = None,
    condition: ConditionOption = "",
    task: TaskOption = None,
    band_hz: BandOption = None,
    settings: SettingsOption = None,
) -> None:
    """Analyse recordings and write one self-contained HTML page, with its tables and figures.

    \b
    For example:
      rigidimeter report demo-study/sessions/day-1 demo-study/sessions/day-2 --out report
      rigidimeter report ankle.csv --reaction --epoch-length-s 20 --out report
    """
    from rigidimeter.cli.reporting import make_report
    from rigidimeter.recording import write_estimates_json

    read = read_inputs(
        inputs,
        settings=settings,
        column=column,
        rate_hz=rate_hz,
        reaction=reaction,
        epoch_length_s=epoch_length_s,
        condition=condition,
        task=task,
        band_hz=band_hz,
    )
    say(read.notices)
    analysis = analyse_inputs(read, method)
    exit_status = status(read, analysis)
    page = make_report(title, read, analysis, out)
    write_estimates_json(out / "estimates.json", analysis)
    typer.echo(str(page))
    raise typer.Exit(exit_status)
