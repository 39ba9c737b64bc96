"""Output on the terminal: the one place where text goes there, with no command in it."""

from __future__ import annotations

import shutil
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer

from rigidimeter.cli.help_pages import HelpGroup


def echo(text: str = "", *, err: bool = False) -> None:
    """Print lines to the standard output, or one message to the standard error.

    Control characters are shown as escapes, in a message also line feeds. Names of files,
    conditions and examiners come from other people's files: an ESC in one could clear the screen or
    change what is read there, and a line feed would break a message in two. On a terminal a message
    is broken between words, elsewhere it stays one line.
    """
    from rigidimeter.core.files import visible

    shown = visible(text, lines=not err)
    if err and sys.stderr.isatty():
        width = shutil.get_terminal_size((80, 24)).columns
        shown = textwrap.fill(shown, width, break_long_words=False, break_on_hyphens=False)
    typer.echo(shown, err=err)


class VisibleErrors(HelpGroup):
    """Commands whose errors of usage, which Click prints itself, show no word as it was given."""

    def make_context(self, *args: Any, **more: Any) -> Any:
        """Parse the options before a command."""
        with _visible():
            return super().make_context(*args, **more)

    def invoke(self, ctx: Any) -> Any:
        """Parse and run a command."""
        with _visible():
            return super().invoke(ctx)


@contextmanager
def _visible() -> Iterator[None]:
    try:
        yield
    except Exception as error:
        # Where Click's own exceptions are depends on the version of typer; they have a `show`.
        if hasattr(error, "show") and isinstance(message := getattr(error, "message", None), str):
            from rigidimeter.core.files import visible

            error.message = visible(message, lines=True)  # type: ignore[attr-defined]
        raise
