"""`rigidimeter design`: options in, text and files out."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rigidimeter.cli.inputs import keep_inputs

if TYPE_CHECKING:
    from rigidimeter.experiment import Foresight, Overview

__all__ = ["design"]


def design(
    settings: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Settings in TOML; what is left out has its default."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for prbs.csv, sinusoid.csv, protocol.csv, bode.svg and design.json.",
        ),
    ] = None,
    json_out: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="File for the numbers, as JSON."),
    ] = None,
    detect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=AMOUNT",
            help="Epochs needed to detect a difference of inertia, damping or stiffness, for "
            "example damping=20% or stiffness=0.3; repeat as needed.",
        ),
    ] = None,
    power: Annotated[float, typer.Option(help="Wanted power of --detect.")] = 0.8,
    alpha: Annotated[float, typer.Option(help="Level of the test of --detect.")] = 0.05,
    optimise: Annotated[
        bool,
        typer.Option(
            "--optimise", help="Search clock, bits and amplitude of the PRBS within the guard."
        ),
    ] = False,
    criterion: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="Of --optimise: minimax (the largest relative error), A (their root mean square) "
            "or D (their volume).",
        ),
    ] = "minimax",
    multisine: Annotated[
        bool,
        typer.Option(
            "--multisine", help="Compare with a multisine; with --out also writes multisine.csv."
        ),
    ] = False,
) -> None:
    """Show what will be commanded and what will come of it, before anyone is perturbed.

    Nothing moves. Shown are perturbations and their band, the session, the stability of the loop,
    and the standard errors to expect. A loop that is unstable, or nearly so, with the joint of a
    condition is refused.

    \b
    For example:
      rigidimeter design
      rigidimeter design --settings rig.toml --out planned --json numbers.json
      rigidimeter design --settings rig.toml --detect damping=20% --power 0.8
      rigidimeter design --settings rig.toml --optimise --multisine
    """
    from rigidimeter.cli.design.design_files import write_folder
    from rigidimeter.cli.design.design_json import document
    from rigidimeter.cli.design.prediction_text import (
        alternative_lines,
        detection_lines,
        ranking_lines,
    )
    from rigidimeter.documents import write_json
    from rigidimeter.dynamics import refuse_unstable
    from rigidimeter.experiment import (
        Wanted,
        assess,
        check_criterion,
        compare_multisine,
        foresee,
        overview,
    )
    from rigidimeter.experiment import detect as epochs_needed
    from rigidimeter.experiment import optimise as search
    from rigidimeter.settings import load_settings

    keep_inputs((json_out,), [settings] if settings is not None else [])
    wanted = [Wanted.parse(text) for text in detect or []]
    check_criterion(criterion)
    planned = overview(load_settings(settings))
    ours, torque_nm = planned.settings, planned.perturbation_nm
    seen = foresee(ours, torque_nm)
    stable = all(margins.stable for margins in seen.stability.conditions.values())
    ranked = search(ours, criterion) if optimise and stable else None
    alternative = compare_multisine(ours, torque_nm) if multisine and stable else None
    detections = [
        epochs_needed(ours, torque_nm, difference, power=power, alpha=alpha)
        for difference in wanted
        if stable
    ]
    lines = list(_lines(planned, seen))
    for found in detections:
        lines += detection_lines(found, power, alpha)
    if ranked is not None:
        lines += ranking_lines(assess(ours, criterion), ranked, criterion)
    if alternative is not None:
        lines += alternative_lines(alternative)
    typer.echo("\n".join([*lines, *_warnings(planned, seen)]))
    numbers = document(planned, seen, ranked, alternative, detections)
    if out is not None:
        names = write_folder(out, planned, seen, ranked, alternative, numbers)
        typer.echo(f"\nWritten to {out}: {', '.join(names)}")
    if json_out is not None:
        write_json(json_out, numbers)
    refuse_unstable(ours, seen.stability)


def _lines(planned: Overview, seen: Foresight) -> Iterator[str]:
    from rigidimeter.cli.design.design_text import commanded_lines
    from rigidimeter.cli.design.prediction_text import precision_lines, stability_lines

    yield from commanded_lines(planned)
    yield from stability_lines(planned, seen)
    yield from precision_lines(planned, seen)


def _warnings(planned: Overview, seen: Foresight) -> Iterator[str]:
    from rigidimeter.cli.design.design_text import wrapped

    if not planned.warnings:
        yield "All of it stays within the guard's limits."
    for warning in (*planned.warnings, *seen.stability.warnings):
        yield from wrapped(f"Warning: {warning}.", indent="")
