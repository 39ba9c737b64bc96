"""Options that several commands share, and commands whose help lists what there is."""

from __future__ import annotations

import shlex
from itertools import pairwise
from typing import Any

import typer
from typer.core import TyperArgument, TyperOption

from rigidimeter.cli.help_pages import HOW_TO_READ, READ, RUN, WRITE, HelpCommand


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


SETTINGS = READ.option(
    "--settings FILE",
    "Settings in TOML. A value that the file does not give has its default; "
    "examples/settings/study.toml is an example.",
)
JSON = WRITE.option("--json FILE", "All results, as JSON.")
FULL = WRITE.flag("--full", "Show every table below the first screen.")
CSV = WRITE.option("--csv FILE", "The table, as CSV.")
NEW_SESSION = WRITE.option("--out DIR", "New folder for the session.", ...)
RIG = READ.option("--rig RIG.toml", "The rig file. Default: the virtual rig.")
PRIORITY = RUN.further(
    "--priority N", "Real-time priority (SCHED_FIFO) of the loop; 0 for none.", 80, min=0, max=99
)
CPU = RUN.further("--cpu N", "Processor of the loop. Default: the last one.")
NEW_STUDY = WRITE.option("--out DIR", "New folder for the study.", ...)
SEED = RUN.further("--seed N", "Seed of all random numbers. Default: that of the settings.")
STUDY_SEED = RUN.option("--seed N", "Seed of all random numbers.", 2023, min=0, max=2**31)
KEY = HOW_TO_READ.further(
    "--key FILE",
    "Blinding key of a study folder (columns code and condition), if it is stored elsewhere.",
)
