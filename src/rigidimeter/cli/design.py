"""`rigidimeter design`: what will be commanded, and what to expect of it, before any hardware."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.cli.inputs import keep_inputs
from rigidimeter.cli.options import JsonOption, SettingsOption
from rigidimeter.cli.output import echo
from rigidimeter.cli.terminal_tables import show


def design(
    settings: SettingsOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder for prbs.csv, sinusoid.csv, protocol.csv, bode.svg and design.json.",
        ),
    ] = None,
    json_out: JsonOption = None,
    detect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=AMOUNT",
            help="Number of epochs needed to detect a difference in inertia, damping or "
            "stiffness, such as damping=20% or stiffness=0.3; repeat as needed.",
        ),
    ] = None,
    power: Annotated[
        float, typer.Option("--power", metavar="P", help="Power of the test for --detect.")
    ] = 0.8,
    alpha: Annotated[
        float,
        typer.Option("--alpha", metavar="P", help="Significance level of the test for --detect."),
    ] = 0.05,
    optimise: Annotated[
        bool,
        typer.Option(
            "--optimise",
            help="Search for the most precise PRBS (clock, bits, amplitude) within the guard's "
            "limits.",
        ),
    ] = False,
    criterion: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="What --optimise minimises: minimax (the largest relative error), A (their root "
            "mean square) or D (the volume of the confidence region).",
        ),
    ] = "minimax",
    multisine: Annotated[
        bool,
        typer.Option(
            "--multisine",
            help="Compare the PRBS with a multisine; with --out also write multisine.csv.",
        ),
    ] = False,
    body_mass_kg: Annotated[
        float | None,
        typer.Option(
            "--body-mass",
            metavar="KG",
            help="Body mass for the bandwidth of App. A, whose subject has 7.7 kg.",
        ),
    ] = None,
    forearm_m: Annotated[
        float | None,
        typer.Option(
            "--forearm",
            metavar="M",
            help="Length of the forearm for the bandwidth of App. A, where it has 0.15 m.",
        ),
    ] = None,
) -> None:
    """Predict stability, standard errors and the number of epochs needed, before anything moves.

    Shows the perturbations and their band, the session, the stability of the loop, and the standard
    errors to expect. The exit status is 1 if the loop is unstable, or nearly so, with the joint of
    a condition.

    \b
    For example:
      rigidimeter design
      rigidimeter design --settings rig.toml --out planned --json numbers.json
      rigidimeter design --settings rig.toml --detect damping=20% --power 0.8
      rigidimeter design --settings rig.toml --optimise --multisine
      rigidimeter design --body-mass 70 --forearm 0.26
    """
    from rigidimeter.cli.design_text import design_blocks
    from rigidimeter.cli.progress import Meter
    from rigidimeter.core.files import write_json
    from rigidimeter.model import refuse_unstable
    from rigidimeter.planning import Forearm, check_criterion, design_document
    from rigidimeter.planning import design as compute

    keep_inputs((json_out,), [settings] if settings is not None else [])
    check_criterion(criterion)
    size = {"body_mass_kg": body_mass_kg, "length_m": forearm_m}
    given = {name: value for name, value in size.items() if value is not None}
    with Meter("design", 1.0, from_first=True) as meter:
        designed = compute(
            settings,
            differences=detect or (),
            power=power,
            alpha=alpha,
            search=criterion if optimise else None,
            with_multisine=multisine,
            forearm=Forearm(**given) if given else None,
            progress=meter.advance,
        )
    show(design_blocks(designed, power, alpha))
    if out is not None:
        from rigidimeter.analysis.report.design_folder import write_design_folder

        echo(f"\nWritten to {out}: {', '.join(write_design_folder(out, designed))}")
    if json_out is not None:
        write_json(json_out, design_document(designed))
    refuse_unstable(designed.settings, designed.stability)
