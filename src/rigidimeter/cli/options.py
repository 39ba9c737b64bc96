"""Options that several commands share: how to read a recording and how to fit it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = [
    "BandOption",
    "ColumnOption",
    "ConditionOption",
    "EpochLengthOption",
    "InputsArgument",
    "MethodOption",
    "RateOption",
    "ReactionOption",
    "SettingsOption",
    "TaskOption",
]

InputsArgument = Annotated[
    list[Path],
    typer.Argument(
        metavar="INPUT...",
        help="Session folders, or recordings as .csv, .npz or .mat.",
        show_default=False,
    ),
]
MethodOption = Annotated[
    str,
    typer.Option(
        "--method",
        metavar="NAME",
        help="bandlimited (measured velocity, all signals in one zero-phase band) or published "
        "(the paper to the letter).",
    ),
]
SettingsOption = Annotated[
    Path | None,
    typer.Option("--settings", metavar="FILE", help="Settings in TOML; see `rigidimeter design`."),
]
ColumnOption = Annotated[
    list[str] | None,
    typer.Option(
        "--column",
        metavar="NAME=COLUMN",
        help="What the file calls a standard column, for example torque_nm=Fz; repeat as needed.",
    ),
]
RateOption = Annotated[
    float | None,
    typer.Option(
        "--rate-hz", metavar="HZ", help="Sampling rate of a file without a time_s column."
    ),
]
ReactionOption = Annotated[
    bool,
    typer.Option(
        "--reaction", help="The torque is the joint's reaction, the negative of what drives it."
    ),
]
EpochLengthOption = Annotated[
    float | None,
    typer.Option(
        "--epoch-length-s",
        metavar="S",
        help="Cut a file without an epoch column into epochs of this length.",
    ),
]
ConditionOption = Annotated[
    str,
    typer.Option(
        "--condition", metavar="NAME", help="Condition of files without a condition column."
    ),
]
TaskOption = Annotated[
    str | None,
    typer.Option(
        "--task",
        metavar="prbs|sinusoid",
        help="Fit J, B, K (prbs) or score (sinusoid); by default the motion decides.",
    ),
]
BandOption = Annotated[
    tuple[float, float] | None,
    typer.Option(
        "--band-hz",
        metavar="LOW HIGH",
        help="Band of the bandlimited fit. Default: 0.15 to 10 where the perturbation is known, "
        "else to 50, and at most 0.4 times the slowest channel's rate.",
    ),
]
