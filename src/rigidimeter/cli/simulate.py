"""`rigidimeter simulate`: a session on the virtual rig."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rigidimeter.cli.help_pages import OPTIONS
from rigidimeter.cli.options import NEW_SESSION, SEED, SETTINGS
from rigidimeter.cli.output import echo
from rigidimeter.cli.progress import Meter
from rigidimeter.core.errors import UserError


def simulate(
    out: Path = NEW_SESSION,
    settings: Path | None = SETTINGS,
    seed: int | None = SEED,
    task: str | None = OPTIONS.option(
        "--task prbs|sinusoid", "Replace the protocol by epochs of this task."
    ),
    condition: str | None = OPTIONS.option(
        "--condition NAME", "Condition of the epochs of --task."
    ),
    epochs: int | None = OPTIONS.option("--epochs N", "Number of epochs of --task."),
    paper_rates: bool = OPTIONS.flag(
        "--paper-rates",
        "Sample as in the paper (Sec. 2.2). Torque at 100 samples/s, motion at 50 samples/s with "
        "up to 5 ms of jitter.",
    ),
    real_time: bool = OPTIONS.flag("--real-time", "Run in real time, not as fast as possible."),
) -> None:
    """Run a protocol on the virtual rig, and record a session folder.

    Uses the same loop, guard and recorder as on hardware, with a simulated drive, arm, subject and
    sensors. Without settings: four PRBS and four sinusoidal epochs in OFF.

    The exit status is 1 if a planned epoch did not end with success, nor did its repetition.

    \b
    For example:
      rigidimeter simulate --out session
      rigidimeter simulate --out other --settings examples/settings/study.toml
      rigidimeter simulate --out dbs --task prbs --condition DBS --epochs 12
    """
    from rigidimeter.core.session import count_epochs, require_all
    from rigidimeter.core.settings import changed_settings, load_settings
    from rigidimeter.planning import too_few_cycles
    from rigidimeter.virtual import PAPER_RATES, run_virtual_session, session_length_s

    if task not in (None, "prbs", "sinusoid"):
        raise UserError(f"--task {task}: must be prbs or sinusoid")
    if task is None and (condition is not None or epochs is not None):
        raise UserError("--condition and --epochs need --task prbs or --task sinusoid")
    chosen = load_settings(settings)
    if condition is not None and condition not in chosen.subject:
        known = ", ".join(sorted(chosen.subject))
        raise UserError(
            f"--condition {condition}: there is no [subject.{condition}] in the settings; known "
            f"conditions: {known}"
        )
    changes: dict[str, Any] = {}
    if seed is not None:
        changes["seed"] = seed
    if task is not None:
        block = {"task": task, "condition": condition or next(iter(chosen.subject), "OFF")}
        count = {} if epochs is None else {"epochs": epochs}
        changes["protocol"] = {"blocks": [block | count]}
    if paper_rates:
        changes["rig"] = PAPER_RATES
    chosen = changed_settings(chosen, changes, "the options")
    if any(block.task == "sinusoid" for block in chosen.protocol.blocks):
        for warning in too_few_cycles(chosen):
            echo(f"warning: {warning}", err=True)
    with Meter("simulate", session_length_s(chosen)) as meter:
        result = run_virtual_session(chosen, out, real_time=real_time, progress=meter.reach)
    good, of = count_epochs(out)
    echo(f"{good} of {of} epochs completed; session in {out}")
    if result.outcome != "success":
        raise UserError(f"{out}: the session ended with {result.outcome}: {result.reason}")
    require_all(out, good, of)
