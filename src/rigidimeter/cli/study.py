"""`rigidimeter study`: make a study folder, empty or virtual; `compare` and `report` read it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.errors import UserError

__all__ = ["study"]

study = typer.Typer(
    name="study",
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Make a study folder: an empty one, or one from the virtual rig.",
)


@study.command()
def new(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="New folder.", show_default=False)],
    title: Annotated[str, typer.Option("--title", metavar="TEXT", help="Title of the study.")] = "",
) -> None:
    """Make a study folder: study.toml and its tables, with comments and no rows.

    Write a row in sessions.csv for each session folder or recording, then compare and report.

    \\b
    For example:
      rigidimeter study new study --title "Elbow, winter"
      rigidimeter compare study
      rigidimeter report study --out study/report
    """
    from rigidimeter.study.new_folder import write_new_study

    write_new_study(folder, title)
    typer.echo(f"{folder}: write your sessions into {folder / 'sessions.csv'}")


@study.command()
def simulate(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="New folder for the study.")],
    seed: Annotated[
        int, typer.Option("--seed", min=0, max=2**31, help="Seed of everything random.")
    ] = 2023,
    design: Annotated[
        str,
        typer.Option(
            "--design",
            metavar="paper|pushing|null",
            help="As in the paper; equal joints but a subject who pushes; no difference at all.",
        ),
    ] = "paper",
    processes: Annotated[
        int, typer.Option("--processes", min=1, max=64, help="Sessions that run side by side.")
    ] = 2,
) -> None:
    """Make a virtual study: sessions of nine days, ratings, and the tables that describe them.

    Every epoch runs through the same loop, guard and recorder as on hardware. The counts are those
    of the paper's Table 1. Equal seeds give equal files, whatever the number of processes.

    \b
    For example:
      rigidimeter study simulate --out study
      rigidimeter compare study
      rigidimeter study simulate --out pushing --design pushing --seed 7
    """
    from rigidimeter.cli.progress import Meter
    from rigidimeter.virtual.study_design import DESIGNS
    from rigidimeter.virtual.study_plan import plan_study
    from rigidimeter.virtual.virtual_study import study_length_s, write_virtual_study

    if design not in DESIGNS:
        raise UserError(f"--design {design}: there is no such design; known: {', '.join(DESIGNS)}")
    chosen = DESIGNS[design]
    length_s = study_length_s(plan_study(chosen, seed))
    with Meter("simulate", length_s) as meter:
        plans = write_virtual_study(out, chosen, seed, processes=processes, progress=meter.reach)
    epochs = {
        condition.name: f"{condition.prbs_epochs} PRBS and {condition.sinusoid_epochs} sinusoidal"
        for condition in chosen.conditions
    }
    typer.echo(f"{chosen.title}, seed {seed}: {len(plans)} sessions on the virtual rig")
    for name, counted in epochs.items():
        ratings = sum(len(plan.ratings) for plan in plans if plan.condition == name)
        typer.echo(f"  {name}: {counted} epochs, {ratings} ratings")
    typer.echo(f"{out}: read it with: rigidimeter compare {out}")
