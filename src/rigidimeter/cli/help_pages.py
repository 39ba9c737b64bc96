"""Help pages: `--help` on one screen, `--help-all` with everything.

Both are made from what a command declares, each option in the `Group` under whose heading it is
shown. `--help` shows the first paragraph and the examples of a command's docstring, and the first
sentence of each option; an option declared by `Group.further` is shown by `--help-all` only.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command


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
        _write_page(self, ctx, formatter, self.full_text)

    def full_text(self, parameter: Any) -> str:
        """Return what `--help-all` shows of a parameter."""
        return str(parameter.help)


class HelpGroup(TyperGroup):
    """A group of commands with both pages."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self.in_full_only = _prepare(self.params)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the page that was asked for."""
        _write_page(self, ctx, formatter)


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
        help_all: Annotated[
            bool,
            typer.Option(
                "--help-all",
                is_eager=True,
                expose_value=False,
                callback=_show_all,
                help="Show everything.",
            ),
        ] = False,
    ) -> None: ...

    return next(each for each in get_command(app).params if each.name == "help_all")


def _write_page(
    command: Any,
    ctx: Any,
    formatter: Any,
    full_text: Callable[[Any], str] = lambda parameter: str(parameter.help),
) -> None:
    everything = ctx.meta.get(_EVERYTHING, False)
    command.format_usage(ctx, formatter)
    first, *rest = inspect.cleandoc(command.help or "").split("\n\n")
    shown = [first, *(text for text in rest if everything or text.startswith("\b"))]
    formatter.write_paragraph()
    with formatter.indentation():
        formatter.write_text("\n\n".join(shown))
    groups = [*_commands(command), *_options(command, ctx, everything, full_text)]
    more = sum(each.name in command.in_full_only for each in command.params)
    names, this = "-h, --help", f"This page; --help-all: {_options_text(more)}all details"
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


def _options_text(more: int) -> str:
    return f"{more} more option{'s' if more > 1 else ''}, " if more else ""


def _commands(command: Any) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """Yield the commands of a group under their panels, in the order of their declaration."""
    panels: dict[str, list[tuple[str, str]]] = {}
    for name, each in getattr(command, "commands", {}).items():
        if not each.hidden:
            rows = panels.setdefault(each.rich_help_panel or "Commands", [])
            rows.append((name, first_sentence(each.help or "")))
    yield from panels.items()


def _options(
    command: Any, ctx: Any, everything: bool, full_text: Callable[[Any], str]
) -> Sequence[tuple[str, list[tuple[str, str]]]]:
    panels: dict[str, list[tuple[str, str]]] = {}
    for each in command.params:
        if each.name != "help_all" and (everything or each.name not in command.in_full_only):
            name, text = each.get_help_record(ctx)
            group = OPTIONS
            if each.param_type_name == "argument":
                name, group = each.metavar, READ
            words = full_text(each) if everything else first_sentence(each.help)
            panel = panels.setdefault(each.rich_help_panel or group, [])
            panel.append((name, words + text.removeprefix(each.help)))  # [required] and the default
    return sorted(panels.items(), key=lambda panel: _ORDER.index(panel[0]))
