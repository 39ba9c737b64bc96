"""Options that several commands share, and commands whose help lists what there is."""

from __future__ import annotations

import shlex
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperArgument, TyperOption

from rigidimeter.cli.help_pages import (
    HOW_TO_READ,
    READ,
    RUN,
    WRITE,
    HelpCommand,
)


class RegistryCommand(HelpCommand):
    """A command whose help lists formats, estimators and terms, those of `--load` too."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Refuse a TOML file without `--settings` where nothing but options is taken."""
        options = [each for each in self.params if isinstance(each, TyperOption)]
        with_value = {name for each in options if not each.is_flag for name in each.opts}
        if len(options) == len(self.params) and "--settings" in with_value:
            for before, word in pairwise(["", *args]):
                if word.endswith(".toml") and word[0] != "-" and before not in with_value:
                    raise typer.BadParameter(
                        f"{word}: if it holds settings, say --settings {shlex.quote(word)}", ctx
                    )
        return super().parse_args(ctx, args)

    def full_text(self, parameter: Any) -> str:
        """Return what there is to choose from; this imports all of it."""
        if isinstance(parameter, TyperArgument) and parameter.name == "paths":
            from rigidimeter.analysis.reading.formats import formats_text

            return f"What to read: {formats_text()}."
        if "--method" in parameter.opts:
            from rigidimeter.analysis.estimation import METHODS

            known = ", ".join(f"{method.name} ({method.title})" for method in METHODS)
            return (
                f"auto (iv where the perturbation was recorded, else bandlimited), or one of: "
                f"{known}."
            )
        if "--to" in parameter.opts:
            from rigidimeter.analysis.export import FORMATS

            return f"Format: {', '.join(f'{each.name} ({each.title})' for each in FORMATS)}."
        if "--terms" in parameter.opts:
            from rigidimeter.analysis.estimation.terms import term_names

            return (
                f"Terms of the torque: {', '.join(term_names())} (+ or - after a reflex: the "
                "direction that stretches the muscle). Repeat to compare your own models."
            )
        return super().full_text(parameter)


SettingsOption = Annotated[
    Path | None,
    typer.Option(
        "--settings",
        metavar="FILE",
        help="Settings in TOML. A value that the file does not give has its default; "
        "examples/settings/study.toml is an example.",
        rich_help_panel=READ,
    ),
]
JsonOption = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="FILE",
        help="All results, as JSON.",
        rich_help_panel=WRITE,
    ),
]
FullOption = Annotated[
    bool,
    typer.Option("--full", help="Show every table below the first screen.", rich_help_panel=WRITE),
]
CsvOption = Annotated[
    Path | None,
    typer.Option(
        "--csv",
        metavar="FILE",
        help="The table, as CSV.",
        rich_help_panel=WRITE,
    ),
]
NewSessionOption = Annotated[
    Path,
    typer.Option("--out", metavar="DIR", help="New folder for the session.", rich_help_panel=WRITE),
]
RigOption = Annotated[
    Path | None,
    typer.Option(
        "--rig",
        metavar="RIG.toml",
        help="The rig file. Default: the virtual rig.",
        rich_help_panel=READ,
    ),
]
PriorityOption = Annotated[
    int,
    typer.Option(
        "--priority",
        metavar="N",
        min=0,
        max=99,
        help="Real-time priority (SCHED_FIFO) of the loop; 0 for none.",
        rich_help_panel=RUN,
        hidden=True,
    ),
]
CpuOption = Annotated[
    int | None,
    typer.Option(
        "--cpu",
        metavar="N",
        help="Processor of the loop. Default: the last one.",
        rich_help_panel=RUN,
        hidden=True,
    ),
]
NewStudyOption = Annotated[
    Path,
    typer.Option("--out", metavar="DIR", help="New folder for the study.", rich_help_panel=WRITE),
]
SeedOption = Annotated[
    int | None,
    typer.Option(
        "--seed",
        metavar="N",
        help="Seed of all random numbers. Default: that of the settings.",
        rich_help_panel=RUN,
        hidden=True,
    ),
]
StudySeedOption = Annotated[
    int,
    typer.Option(
        "--seed",
        metavar="N",
        min=0,
        max=2**31,
        help="Seed of all random numbers.",
        rich_help_panel=RUN,
    ),
]
KeyOption = Annotated[
    Path | None,
    typer.Option(
        "--key",
        metavar="FILE",
        help="Blinding key of a study folder (columns code and condition), if it is stored "
        "elsewhere.",
        rich_help_panel=HOW_TO_READ,
        hidden=True,
    ),
]
