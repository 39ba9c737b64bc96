"""Options that several commands share, each declared once.

`reads_recordings` gives a command the options that say how to read recordings and how to fit them;
the command takes a `Recordings` as its first parameter.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast, get_type_hints

import typer
from typer.core import TyperArgument, TyperCommand, TyperOption

from rigidimeter.cli.reading_options import (
    ClockOffsetOption,
    ColumnOption,
    ConditionOption,
    EpochLengthSOption,
    JoinOption,
    LeaveOutOption,
    MappingOption,
    NamesOption,
    OffsetOption,
    RateHzOption,
    ReactionOption,
    ScaleOption,
    SkipRowsOption,
    TableOption,
    TaskOption,
    UnitOption,
)
from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.recording import Recording
    from rigidimeter.records import Task
    from rigidimeter.settings import Settings


class RegistryCommand(TyperCommand):
    """A command whose help lists formats, estimators and terms, those of `--load` too."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Fill in what there is to choose from; only here, because it imports all of it."""
        for parameter in self.params:
            if isinstance(parameter, TyperArgument) and parameter.name == "paths":
                from rigidimeter.recording.formats import formats_text

                parameter.help = f"What to read: {formats_text()}."
            if isinstance(parameter, TyperOption) and "--method" in parameter.opts:
                from rigidimeter.estimation import METHODS

                known = ", ".join(f"{method.name} ({method.title})" for method in METHODS)
                parameter.help = (
                    "auto (iv where the perturbation was recorded, else bandlimited), or one of: "
                    f"{known}."
                )
            if isinstance(parameter, TyperOption) and "--to" in parameter.opts:
                from rigidimeter.exporting import FORMATS

                known = ", ".join(f"{each.name} ({each.title})" for each in FORMATS)
                parameter.help = f"The format: {known}."
            if isinstance(parameter, TyperOption) and "--terms" in parameter.opts:
                from rigidimeter.estimation.terms import term_names

                parameter.help = (
                    f"Terms of the torque: {', '.join(term_names())} (+ or - after a reflex: the "
                    "direction that stretches the muscle). Repeat to compare your own models."
                )
        super().format_help(ctx, formatter)


SettingsOption = Annotated[
    Path | None,
    typer.Option(
        "--settings",
        metavar="FILE",
        help="Settings in TOML, such as examples/settings/study.toml. A value that the file does "
        "not give has its default.",
    ),
]
JsonOption = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", help="Write all results to a JSON file.")
]
CsvOption = Annotated[
    Path | None, typer.Option("--csv", metavar="FILE", help="Write the table to a CSV file.")
]
NewSessionOption = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="New folder for the session.")
]
NewStudyOption = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="New folder for the study.")
]
SeedOption = Annotated[
    int | None,
    typer.Option(
        "--seed", metavar="N", help="Seed of all random numbers. Default: that of the settings."
    ),
]
StudySeedOption = Annotated[
    int,
    typer.Option("--seed", metavar="N", min=0, max=2**31, help="Seed of all random numbers."),
]
KeyOption = Annotated[
    Path | None,
    typer.Option(
        "--key",
        metavar="FILE",
        help="Blinding key of a study folder (columns code and condition), if it is kept "
        "elsewhere.",
    ),
]


@dataclass(frozen=True)
class Recordings:
    """What the user named, and how to read and fit it; the fields are options of the commands."""

    paths: Annotated[
        list[Path], typer.Argument(metavar="INPUT", help="What to read.", show_default=False)
    ]
    method: Annotated[
        str, typer.Option("--method", metavar="NAME", help="The estimator, by its name.")
    ] = "auto"
    column: ColumnOption = None
    unit: UnitOption = None
    scale: ScaleOption = None
    offset: OffsetOption = None
    skip_rows: SkipRowsOption = 0
    names: NamesOption = None
    table: TableOption = None
    mapping: MappingOption = None
    join: JoinOption = False
    clock_offset: ClockOffsetOption = None
    rate_hz: RateHzOption = None
    reaction: ReactionOption = False
    epoch_length_s: EpochLengthSOption = None
    condition: ConditionOption = None
    task: TaskOption = None
    leave_out: LeaveOutOption = None
    band_hz: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--band-hz",
            metavar="LOW HIGH",
            help="Band of the fit. Default: bandlimited 0.15 to 10 where the perturbation is "
            "known, else to 50; iv and spectral 0.15 to 30; at most 0.4 times the slowest "
            "channel's rate.",
        ),
    ] = None
    controller: Annotated[
        tuple[float, float] | None,
        typer.Option(
            "--controller",
            metavar="J_C B_C",
            help="Inertia in kg·m² and damping in N·m·s/rad of the admittance, for files without "
            "a manifest. Default: those of the settings, else the paper's. A wrong value makes iv "
            "less precise but does not bias it.",
        ),
    ] = None
    settings: SettingsOption = None

    def read(self) -> Recording:
        """Read every input, with the band and the controller of the options in its settings.

        Raises
        ------
        UserError
            If an option is wrong, or not one input can be read.
        """
        from rigidimeter.recording import read

        recording = read(
            self.paths,
            condition=self.condition,
            leave_out=self.leave_out or (),
            settings=self.settings,
            join=self.join,
            clock_offset=self.asked_clock_offset,
            **self.of_files(),
        )
        return replace(recording, settings=self.adjust(recording.settings))

    @property
    def asked_clock_offset(self) -> float | str | None:
        """The clock offset in s, or ``found``."""
        try:
            return None if self.clock_offset is None else float(self.clock_offset)
        except ValueError:
            return self.clock_offset

    def of_files(self) -> dict[str, Any]:
        """Return the arguments of `recording.read` that say how a file is read.

        Raises
        ------
        UserError
            If an option is not written as NAME=VALUE.
        """
        return {
            "column": _pairs("column", self.column, "torque=Fz"),
            "unit": _pairs("unit", self.unit, "angle=deg"),
            "scale": _pairs("scale", self.scale, "'torque=2.5 Nm/V'"),
            "offset": _pairs("offset", self.offset, "'torque=0.1 V'"),
            "rate_hz": self.rate_hz,
            "reaction": self.reaction,
            "epoch_length_s": self.epoch_length_s,
            "task": cast("Task | None", self.task),
            "skip_rows": self.skip_rows,
            "names": [name.strip() for name in self.names.split(",")] if self.names else (),
            "table": self.table or "",
            "mapping": self.mapping,
        }

    def adjust(self, settings: Settings) -> Settings:
        """Return settings with the band and the controller of the options.

        Raises
        ------
        UserError
            If a value is out of its range.
        """
        from rigidimeter.settings import changed_settings

        for option, change in self._changes():
            settings = changed_settings(settings, change, option)
        return settings

    def changes(self) -> dict[str, Any]:
        """Return the band and the controller of the options as values of settings.

        Raises
        ------
        UserError
            If a value is out of its range.
        """
        from rigidimeter.settings import Settings

        self.adjust(Settings())
        return {table: values for _, change in self._changes() for table, values in change.items()}

    def _changes(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield what each option changes in the settings, with the option as it was given."""
        if self.band_hz is not None:
            low, high = self.band_hz
            band = {
                "band_low_hz": low,
                "band_high_hz": high,
                "band_high_unknown_hz": high,
                "band_high_closed_loop_hz": high,
            }
            yield f"--band-hz {low:g} {high:g}", {"estimation": band}
        if self.controller is not None:
            inertia, damping = self.controller
            values = {"inertia_kg_m2": inertia, "damping_nm_s_rad": damping}
            yield f"--controller {inertia:g} {damping:g}", {"controller": values}


def reads_recordings(command: Callable[..., None]) -> Callable[..., None]:
    """Replace a command's first parameter, a `Recordings`, by the options that make one."""
    shared = inspect.signature(Recordings).parameters
    own = list(inspect.signature(command).parameters.values())[1:]
    hints = {
        **get_type_hints(command, include_extras=True),
        **get_type_hints(Recordings, include_extras=True),
    }

    @functools.wraps(command)
    def with_options(**given: object) -> None:
        reading = {name: given.pop(name) for name in shared}
        command(Recordings(**reading), **given)  # type: ignore[arg-type]

    with_options.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[parameter.name])
            for parameter in (*shared.values(), *own)
        ]
    )
    with_options.__annotations__ = {**hints, "return": None}
    del with_options.__wrapped__
    return with_options


def _pairs(option: str, pairs: list[str] | None, example: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        if not (name and equals and text):
            raise UserError(
                f"--{option} {pair}: write NAME={'COLUMN' if option == 'column' else 'VALUE'}, for "
                f"example --{option} {example}"
            )
        if name in found:
            raise UserError(f"--{option} {pair}: {name} was already given as {found[name]}")
        found[name] = text
    return found
