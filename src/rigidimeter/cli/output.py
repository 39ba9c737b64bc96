"""Output on the terminal: the one place where text goes there, with no command in it."""

from __future__ import annotations

import typer


def echo(text: str = "", *, err: bool = False) -> None:
    """Print lines to the standard output, or error; control characters are shown as escapes.

    Names of files, conditions and examiners come from other people's files: an ESC in one could
    clear the screen or change what is read there.
    """
    from rigidimeter.documents.escaping import visible

    typer.echo(visible(text, lines=True), err=err)
