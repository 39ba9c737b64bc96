"""Help pages: `--help` on one screen, `--help-all` with everything.

Both are made from what a command declares, each option in the `Group` under whose heading it is
shown. `--help` shows the first paragraph and the examples of a command's docstring, and the first
sentence of each option; an option declared by `Group.further` is shown by `--help-all` only.
"""

from __future__ import annotations

import inspect
import re
import shlex
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption
from typer.main import get_command

from rigidimeter.core.words import plural


class Group(str):
    """A heading of help pages, which declares the options below it."""

    __slots__ = ()

    def option(self, declared: str, text: str, default: Any = None, **more: Any) -> Any:
        """Return the default of a parameter of a command, which makes the parameter an option.

        Parameters
        ----------
        declared : str
            As the help page shows it, such as ``--out DIR``; a flag has its name alone.
        text : str
            Of which `--help` shows the first sentence.
        default : object
            ``...`` for an option that must be given.
        **more
            What typer takes, such as `min` and `max`.
        """
        name, _, metavar = declared.partition(" ")
        return typer.Option(
            default, name, metavar=metavar or None, help=text, rich_help_panel=self, **more
        )

    def flag(self, name: str, text: str, **more: Any) -> Any:
        """Return an option that is given or not."""
        return self.option(name, text, False, **more)

    def further(self, declared: str, text: str, default: Any = None, **more: Any) -> Any:
        """Return an option that `--help-all` alone shows."""
        return self.option(declared, text, default, hidden=True, **more)


def argument(metavar: str, text: str, default: Any = ..., **more: Any) -> Any:
    """Return the default of a parameter that is given without a name, as an option is."""
    return typer.Argument(default, metavar=metavar, help=text, show_default=False, **more)


READ = Group("What to read")
HOW_TO_READ = Group("How to read it")
COMPARE = Group("What to compare")
PERTURB = Group("How to perturb")
DETECT = Group("What to detect")
ESTIMATE = Group("How to estimate")
WRITE = Group("What to write")
RUN = Group("How to run")
PAGE = Group("The page in the browser")
OPTIONS = Group("Options")
_ORDER = (READ, HOW_TO_READ, COMPARE, DETECT, PERTURB, ESTIMATE, RUN, PAGE, OPTIONS, WRITE)

_WIDEST_NAME = 26
_EVERYTHING = "rigidimeter.help_all"
_COMPLETION = {"install_completion", "show_completion"}
"""Options that typer adds to the program itself, after it was made."""


class HelpCommand(TyperCommand):
    """A command with both pages."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self.in_full_only = _prepare(self.params)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the page that was asked for."""
        _write_page(self, ctx, formatter)

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


class HelpGroup(TyperGroup):
    """A group of commands with both pages."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self.in_full_only = _prepare(self.params)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the page that was asked for."""
        _write_page(self, ctx, formatter)


def full_text(parameter: Any) -> str:
    """Return what `--help-all` shows of a parameter, with all that there is to choose from."""
    if isinstance(parameter, TyperArgument) and parameter.name == "paths":
        from rigidimeter.analysis.reading.formats import formats_text

        return f"What to read: {formats_text()}."
    if "--method" in parameter.opts:
        from rigidimeter.analysis.estimation import METHODS

        known = ", ".join(f"{method.name} ({method.title})" for method in METHODS)
        return (
            f"auto (iv where the perturbation was recorded, else bandlimited), or one of: {known}."
        )
    if "--to" in parameter.opts:
        from rigidimeter.analysis.export import FORMATS

        return f"Format: {', '.join(f'{each.name} ({each.title})' for each in FORMATS)}."
    if "--terms" in parameter.opts:
        from rigidimeter.analysis.estimation import term_names

        return (
            f"Terms of the torque: {', '.join(term_names())} (+ or - after a reflex: the "
            "direction that stretches the muscle). Repeat to compare your own models."
        )
    return str(parameter.help)


def first_sentence(text: str) -> str:
    """Return the first sentence, without its full stop.

    Examples
    --------
    >>> first_sentence("The estimator, such as iv. Default: auto.")
    'The estimator, such as iv'
    """
    return re.split(r"(?<=\.)\s+(?=[A-Z`])", " ".join(text.split()), maxsplit=1)[0].rstrip(".")


def _prepare(parameters: list[Any]) -> set[str]:
    """Add `--help-all`, and return the names of the options that only it shows.

    They are not `hidden` afterwards, since the completion of shells leaves hidden options out.
    """
    behind = {each.name for each in parameters if each.hidden}
    for parameter in parameters:
        parameter.hidden = False
    parameters.append(_help_all())
    return behind | _COMPLETION


def _show_all(ctx: typer.Context, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        ctx.meta[_EVERYTHING] = True
        typer.echo(ctx.get_help())
        raise typer.Exit


def _help_all() -> Any:
    """Return the option, made as typer makes those of a function; there is no other public way."""
    app = typer.Typer(add_completion=False)

    @app.command()
    def page(
        help_all: bool = OPTIONS.flag(
            "--help-all", "Show everything.", is_eager=True, expose_value=False, callback=_show_all
        ),
    ) -> None: ...

    return next(each for each in get_command(app).params if each.name == "help_all")


def _write_page(command: Any, ctx: Any, formatter: Any) -> None:
    everything = ctx.meta.get(_EVERYTHING, False)
    command.format_usage(ctx, formatter)
    first, *rest = inspect.cleandoc(command.help or "").split("\n\n")
    shown = [first, *(text for text in rest if everything or text.startswith("\b"))]
    formatter.write_paragraph()
    with formatter.indentation():
        formatter.write_text("\n\n".join(shown))
    groups = [*_groups(command, ctx, everything)]
    more = sum(each.name in command.in_full_only for each in command.params)
    others = f"{plural(more, 'more option')}, " if more else ""
    names, this = "-h, --help", f"This page; --help-all: {others}all details"
    if everything:
        names, this = "-h, --help, --help-all", "One screen; this page"
    rows = [row for _, group in groups for row in group]
    width = min(max(len(name) for name, _ in rows), _WIDEST_NAME) if rows else len(names)
    formatter.write_paragraph()
    for number, (title, group) in enumerate(groups):
        if everything and number:
            formatter.write_paragraph()
        formatter.write_heading(title)
        with formatter.indentation():
            formatter.write_dl([(name.ljust(width), text) for name, text in group], col_max=width)
    with formatter.indentation():
        formatter.write_dl([(names.ljust(width), this)], col_max=max(width, len(names)))


def _groups(
    command: Any, ctx: Any, everything: bool
) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """Yield commands in the order of their declaration, and options in that of their groups."""
    commands: dict[str, list[tuple[str, str]]] = {}
    for name, each in getattr(command, "commands", {}).items():
        panel = commands.setdefault(each.rich_help_panel or "Commands", [])
        panel.append((name, first_sentence((each.help or "").partition("\n\n")[0])))
    options: dict[str, list[tuple[str, str]]] = {}
    for each in command.params:
        if each.name != "help_all" and (everything or each.name not in command.in_full_only):
            name, text = each.get_help_record(ctx)
            group = OPTIONS
            if each.param_type_name == "argument":
                name, group = each.metavar, READ
            words = full_text(each) if everything else first_sentence(each.help)
            panel = options.setdefault(each.rich_help_panel or group, [])
            panel.append((name, words + text.removeprefix(each.help)))  # [required] and the default
    yield from commands.items()
    yield from sorted(options.items(), key=lambda panel: _ORDER.index(panel[0]))
