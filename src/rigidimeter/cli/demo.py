"""`rigidimeter demo`: a virtual OFF/DBS study from the perturbation to the report."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.errors import UserError

__all__ = ["demo"]


def demo(
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="New folder for the study.")
    ] = Path("demo-study"),
    prbs_epochs: Annotated[
        int, typer.Option("--prbs-epochs", min=1, max=500, help="PRBS epochs a condition and day.")
    ] = 10,
    sinusoid_epochs: Annotated[
        int,
        typer.Option("--sinusoid-epochs", min=1, max=500, help="Sinusoids a condition and day."),
    ] = 8,
    seed: Annotated[
        int, typer.Option("--seed", min=0, max=2**31, help="Seed of the study.")
    ] = 2023,
) -> None:
    """Make a virtual study folder of two days, compare its conditions, and write its report.

    Each day has PRBS and sinusoidal epochs in OFF and DBS on the virtual rig, 40 and 32 in all, and
    ratings. The same as study simulate, compare and report, for a smaller study. A folder that is
    there already under the same name is moved aside, not overwritten.

    \b
    For example:
      rigidimeter demo
      rigidimeter demo --out small --prbs-epochs 3 --sinusoid-epochs 3
    """
    from rigidimeter.cli.options import Recordings
    from rigidimeter.cli.progress import Meter
    from rigidimeter.cli.report import write_page
    from rigidimeter.cli.study_input import analysed_study
    from rigidimeter.virtual.study_design import two_day_design
    from rigidimeter.virtual.study_plan import plan_study
    from rigidimeter.virtual.virtual_study import study_length_s, write_virtual_study

    start_s = time.monotonic()
    _move_aside(out)
    design = two_day_design(prbs_epochs, sinusoid_epochs)
    typer.echo(
        f"A virtual subject, 2 days, OFF and DBS: {4 * prbs_epochs} PRBS and "
        f"{4 * sinusoid_epochs} sinusoidal epochs of 20 s with their rests"
    )
    with Meter("simulate", study_length_s(plan_study(design, seed))) as meter:
        write_virtual_study(out, design, seed, progress=meter.reach)
    found = analysed_study(out, Recordings([out]), None)
    page = write_page(found.result, out / "report")
    typer.echo(f"Done in {time.monotonic() - start_s:.0f} s. Open the report in a browser:")
    typer.echo(str(page.resolve()))
    raise typer.Exit(found.status)


def _move_aside(out: Path) -> None:
    """Give an earlier study another name, so that nothing is written over."""
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return
    if not (out / "sessions").is_dir():
        raise UserError(f"--out {out}: is there already and is no earlier demo; name a new folder")
    number = 1
    while (aside := out.with_name(f"{out.name}-{number}")).exists():
        number += 1
    try:
        out.rename(aside)
    except OSError as error:
        raise UserError(f"{out}: cannot be moved aside ({error.strerror or error})") from None
    typer.echo(f"{out} was there already and is now {aside}")
