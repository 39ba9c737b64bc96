"""`rigidimeter simulate`: a session on the virtual rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rigidimeter.cli.options import SettingsOption
from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.settings import Settings

__all__ = ["simulate"]


def simulate(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="New folder for the session.")],
    settings: SettingsOption = None,
    seed: Annotated[
        int | None, typer.Option("--seed", help="Seed of everything random; recorded.")
    ] = None,
    task: Annotated[
        str | None,
        typer.Option("--task", metavar="prbs|sinusoid", help="Run epochs of this task alone."),
    ] = None,
    condition: Annotated[
        str | None,
        typer.Option("--condition", metavar="NAME", help="In this condition (with --task)."),
    ] = None,
    epochs: Annotated[
        int | None, typer.Option("--epochs", metavar="N", help="This many (with --task).")
    ] = None,
    paper_rates: Annotated[
        bool,
        typer.Option(
            "--paper-rates",
            help="Torque at 100 samples/s, motion at 50 with up to 5 ms of jitter (Sec. 2.2).",
        ),
    ] = False,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="Keep real time instead of as fast as it goes.")
    ] = False,
) -> None:
    """Run a protocol on the virtual rig and record it as a session folder.

    The same loop, guard and recorder as on hardware, with a simulated drive, arm, subject and
    sensors behind them. Without settings: four PRBS and four sinusoidal epochs in OFF.

    \b
    For example:
      rigidimeter simulate --out session
      rigidimeter simulate --out session --settings study.toml --seed 7
      rigidimeter simulate --out session --task prbs --condition DBS --epochs 12 --paper-rates
    """
    from rigidimeter.cli.progress import Meter
    from rigidimeter.settings import load_settings
    from rigidimeter.virtual.virtual_session import run_virtual_session, session_length_s

    if task not in (None, "prbs", "sinusoid"):
        raise UserError(f"--task {task}: must be prbs or sinusoid")
    chosen = _changed(load_settings(settings), seed, task, condition, epochs, paper_rates)
    with Meter("simulate", session_length_s(chosen)) as meter:
        result = run_virtual_session(chosen, out, real_time=real_time, progress=meter.reach)
    typer.echo(
        f"{result.epochs_good} of {result.epochs_run} epochs ended with success; session in {out}"
    )
    if result.epochs_run and not result.epochs_good:
        raise UserError(
            f"{out}: no epoch ended with success; events.jsonl holds the reason of each"
        )
    if result.outcome != "success":
        raise UserError(f"{out}: the session ended with {result.outcome}: {result.reason}")


def _changed(
    settings: Settings,
    seed: int | None,
    task: str | None,
    condition: str | None,
    epochs: int | None,
    paper_rates: bool,
) -> Settings:
    """Return the settings with what the options change, validated again."""
    from rigidimeter.settings import dump_settings, parse_settings

    values = dump_settings(settings)
    if seed is not None:
        values["seed"] = seed
    if task is not None:
        first = next(iter(settings.subject), "OFF")
        block: dict[str, Any] = {"task": task, "condition": condition or first}
        if epochs is not None:
            block["epochs"] = epochs
        values["protocol"]["blocks"] = [block]
    elif condition is not None or epochs is not None:
        raise UserError("--condition and --epochs need --task prbs or --task sinusoid")
    if paper_rates:
        from rigidimeter.virtual.paper_rates import PAPER_RATES

        for sensor, changes in PAPER_RATES.items():
            values["rig"][sensor] |= changes
    return parse_settings(values, source="the options")
