"""Options that several commands share: how to read a recording and how to fit it.

`reads_recordings` gives them to a command, which takes a `Recordings` as its first parameter.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer
from typer.core import TyperCommand, TyperOption

from rigidimeter.cli.inputs import Recordings

__all__ = ["MethodsCommand", "SettingsOption", "reads_recordings"]


class MethodsCommand(TyperCommand):
    """A command whose help lists the estimators, those of `--load` among them."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Fill in what `--method` takes; only here, because it imports every estimator."""
        for option in self.params:
            if isinstance(option, TyperOption) and "--method" in option.opts:
                from rigidimeter.estimation import METHODS

                known = ", ".join(f"{method.name} ({method.title})" for method in METHODS)
                option.help = (
                    "auto (iv where the perturbation was recorded, else bandlimited), or one of: "
                    f"{known}."
                )
        super().format_help(ctx, formatter)


InputsArgument = Annotated[
    list[Path],
    typer.Argument(
        metavar="INPUT",
        help="Session folders, or recordings as .csv, .npz or .mat.",
        show_default=False,
    ),
]
MethodOption = Annotated[
    str,
    typer.Option(
        "--method",
        metavar="NAME",
        help="The estimator, by its name.",
    ),
]
SettingsOption = Annotated[
    Path | None,
    typer.Option(
        "--settings", metavar="FILE", help="Settings in TOML, such as examples/settings/study.toml."
    ),
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
    list[str] | None,
    typer.Option(
        "--condition",
        metavar="NAME",
        help="Condition of files without a condition column: once for all of them, or once for "
        "each input in their order.",
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
        help="Band of the fit. Default: bandlimited 0.15 to 10 where the perturbation is known, "
        "else to 50; iv, spectral and ml 0.15 to 30; at most 0.4 times the slowest channel's rate.",
    ),
]
ControllerOption = Annotated[
    tuple[float, float] | None,
    typer.Option(
        "--controller",
        metavar="J_C B_C",
        help="Inertia in kg·m² and damping in N·m·s/rad of the admittance, for files without a "
        "manifest. Default: those of the settings, else the paper's. A wrong value makes iv less "
        "precise, not wrong.",
    ),
]


def _reading(
    inputs: InputsArgument,
    method: MethodOption = "auto",
    column: ColumnOption = None,
    rate_hz: RateOption = None,
    reaction: ReactionOption = False,
    epoch_length_s: EpochLengthOption = None,
    condition: ConditionOption = None,
    task: TaskOption = None,
    band_hz: BandOption = None,
    controller: ControllerOption = None,
    settings: SettingsOption = None,
) -> Recordings:
    """Hold the shared parameters and what becomes of them."""
    return Recordings(
        inputs,
        method,
        column,
        rate_hz,
        reaction,
        epoch_length_s,
        condition,
        task,
        band_hz,
        controller,
        settings,
    )


def reads_recordings(command: Callable[..., None]) -> Callable[..., None]:
    """Replace a command's first parameter, a `Recordings`, by the options that make one."""
    shared = inspect.signature(_reading).parameters
    own = list(inspect.signature(command).parameters.values())[1:]

    @functools.wraps(command)
    def with_options(**given: object) -> None:
        reading = {name: given.pop(name) for name in shared}
        command(_reading(**reading), **given)  # type: ignore[arg-type]

    parameters = [*shared.values(), *own]
    hints = {
        **get_type_hints(command, include_extras=True),
        **get_type_hints(_reading, include_extras=True),
        "return": None,
    }
    with_options.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[parameter.name])
            for parameter in parameters
        ]
    )
    with_options.__annotations__ = {p.name: hints[p.name] for p in parameters}
    del with_options.__wrapped__
    return with_options
