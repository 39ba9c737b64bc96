"""`rigidimeter demo`: a virtual OFF/DBS study from the perturbation to the report."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from rigidimeter.errors import UserError

__all__ = ["demo"]

DAYS = 2
"""Sessions, run side by side; the order of the conditions alternates, as in Sec. 2.5."""

STUDY: dict[str, Any] = {
    "subject": {
        "OFF": {
            "damping_nm_s_rad": 0.1368,
            "stiffness_nm_rad": 1.751,
            "inertia_cv_percent": 2.0,
            "damping_cv_percent": 12.0,
            "stiffness_cv_percent": 15.0,
            "voluntary_sd_nm": 0.01,
        },
        "DBS": {
            "damping_nm_s_rad": 0.117,
            "stiffness_nm_rad": 1.42,
            "inertia_cv_percent": 2.0,
            "damping_cv_percent": 12.0,
            "stiffness_cv_percent": 15.0,
            "voluntary_sd_nm": 0.01,
        },
    }
}
"""A virtual subject: OFF has the values of Sec. 3.4; DBS is chosen here, the paper prints none."""


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
    """Run a virtual OFF/DBS study, analyse it, and write its report.

    Two days, each with PRBS and sinusoidal epochs in OFF and DBS on the virtual rig: 40 PRBS and 32
    sinusoidal epochs unless told otherwise. A study that is there already under the same name is
    moved aside, not overwritten.

    \b
    For example:
      rigidimeter demo
      rigidimeter demo --out small --prbs-epochs 3 --sinusoid-epochs 3
    """
    from rigidimeter.cli.inputs import analyse_inputs, say, status
    from rigidimeter.cli.options import Recordings
    from rigidimeter.cli.reporting import make_report
    from rigidimeter.recording import write_estimates_json

    start_s = time.monotonic()
    _move_aside(out)
    sessions = [out / "sessions" / f"day-{day + 1}" for day in range(DAYS)]
    settings = [_day(day, prbs_epochs, sinusoid_epochs, seed) for day in range(DAYS)]
    typer.echo(
        f"A virtual subject, {DAYS} days, OFF and DBS: {2 * DAYS * prbs_epochs} PRBS and "
        f"{2 * DAYS * sinusoid_epochs} sinusoidal epochs of 20 s with their rests"
    )
    _simulate(settings, sessions)
    read = Recordings(sessions).read()
    say(read.notices)
    analysis = analyse_inputs(read, "auto")
    exit_status = status(read, analysis)
    write_estimates_json(out / "estimates.json", analysis)
    page = make_report("A virtual study of elbow rigidity", read, analysis, out / "report")
    typer.echo(f"Done in {time.monotonic() - start_s:.0f} s. Open the report in a browser:")
    typer.echo(str(page.resolve()))
    raise typer.Exit(exit_status)


def _day(day: int, prbs_epochs: int, sinusoid_epochs: int, seed: int) -> dict[str, Any]:
    """Return the settings of one day; even days begin with OFF, odd ones with DBS."""
    order = ("OFF", "DBS") if day % 2 == 0 else ("DBS", "OFF")
    blocks = [
        {"task": task, "condition": condition, "epochs": epochs}
        for condition in order
        for task, epochs in (("prbs", prbs_epochs), ("sinusoid", sinusoid_epochs))
    ]
    return {**STUDY, "seed": seed + day, "protocol": {"blocks": blocks}}


def _simulate(settings: list[dict[str, Any]], folders: list[Path]) -> None:
    """Run the sessions side by side, a process each; end them when we are interrupted."""
    from multiprocessing import get_context

    from rigidimeter.cli.progress import Meter
    from rigidimeter.settings import parse_settings
    from rigidimeter.virtual.virtual_session import session_length_s

    total_s = sum(session_length_s(parse_settings(values)) for values in settings)
    context = get_context("spawn")
    reached = context.Array("d", len(settings), lock=False)
    days = [
        context.Process(target=_run_day, args=(index, values, str(folder), reached), daemon=True)
        for index, (values, folder) in enumerate(zip(settings, folders, strict=True))
    ]
    with Meter("simulate", total_s) as meter:
        for day in days:
            day.start()
        try:
            while any(day.is_alive() for day in days):
                time.sleep(0.1)
                meter.reach(sum(reached))
        finally:
            for day in days:
                day.terminate()  # does nothing to one that has ended
                day.join()
    failed = [str(folder) for day, folder in zip(days, folders, strict=True) if day.exitcode]
    if failed:
        raise UserError(f"{', '.join(failed)}: the session did not end with success")


def _run_day(index: int, values: dict[str, Any], folder: str, reached: Any) -> None:
    """Run one session in its own process, reporting its time as it goes."""
    import sys

    from rigidimeter.settings import parse_settings
    from rigidimeter.virtual.virtual_session import run_virtual_session

    def reach(time_s: float) -> None:
        reached[index] = time_s

    result = run_virtual_session(parse_settings(values), Path(folder), progress=reach)
    sys.exit(result.outcome != "success")


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
