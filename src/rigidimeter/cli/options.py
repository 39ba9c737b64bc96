"""Options that several commands share, and commands whose help lists what there is."""

from __future__ import annotations

import shlex
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperArgument, TyperCommand, TyperOption


class RegistryCommand(TyperCommand):
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

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Fill in what there is to choose from; only here, because it imports all of it."""
        for parameter in self.params:
            if isinstance(parameter, TyperArgument) and parameter.name == "paths":
                from rigidimeter.analysis.reading.formats import formats_text

                parameter.help = f"What to read: {formats_text()}."
            if isinstance(parameter, TyperOption) and "--method" in parameter.opts:
                from rigidimeter.analysis.estimation import METHODS

                known = ", ".join(f"{method.name} ({method.title})" for method in METHODS)
                parameter.help = (
                    "auto (iv where the perturbation was recorded, else bandlimited), or one of: "
                    f"{known}."
                )
            if isinstance(parameter, TyperOption) and "--to" in parameter.opts:
                from rigidimeter.analysis.export import FORMATS

                known = ", ".join(f"{each.name} ({each.title})" for each in FORMATS)
                parameter.help = f"The format: {known}."
            if isinstance(parameter, TyperOption) and "--terms" in parameter.opts:
                from rigidimeter.analysis.estimation.terms import term_names

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
RigOption = Annotated[
    Path | None,
    typer.Option("--rig", metavar="RIG.toml", help="The rig file. Default: the virtual rig."),
]
PriorityOption = Annotated[
    int,
    typer.Option(
        "--priority",
        metavar="N",
        min=0,
        max=99,
        help="Real-time priority (SCHED_FIFO) of the loop; 0 for none.",
    ),
]
CpuOption = Annotated[
    int | None,
    typer.Option("--cpu", metavar="N", help="Processor of the loop. Default: the last one."),
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
