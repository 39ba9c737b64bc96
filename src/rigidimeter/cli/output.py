"""Output on the terminal: the one place where text goes there, with no command in it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer
from typer.core import TyperGroup


def echo(text: str = "", *, err: bool = False) -> None:
    """Print lines to the standard output, or one message to the standard error.

    Control characters are shown as escapes, in a message also line feeds. Names of files,
    conditions and examiners come from other people's files: an ESC in one could clear the screen or
    change what is read there, and a line feed would break a message in two.
    """
    from rigidimeter.documents.escaping import visible

    typer.echo(visible(text, lines=not err), err=err)


class VisibleErrors(TyperGroup):
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
    from rigidimeter.documents.escaping import visible

    try:
        yield
    except Exception as error:
        # Where Click's own exceptions are depends on the version of typer; they have a `show`.
        if hasattr(error, "show") and isinstance(message := getattr(error, "message", None), str):
            error.message = visible(message, lines=True)  # type: ignore[attr-defined]
        raise
