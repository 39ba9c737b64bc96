"""Output: the one place where text goes to the terminal, and where files may be written."""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rigidimeter.cli.help_pages import HelpGroup
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.core.records import Notice


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


def say(notices: Iterable[Notice]) -> None:
    """Print notices to the standard error, one sentence a line.

    What is the same of several files is said once, of the first of them.
    """
    same: dict[tuple[str, str, str], list[str]] = {}
    for notice in notices:
        place, colon, rest = notice.text.partition(": ")
        # A separator marks a path; only what follows it may be the same of other files.
        key = (rest, Path(place).name) if colon and os.sep in place else (notice.text, "")
        same.setdefault((notice.level, *key), []).append(place)
    for (level, text, name), places in same.items():
        if name and len(places) > 1:
            text = f"{places[0]} and {len(places) - 1} more: {text}"
        elif name:
            text = f"{places[0]}: {text}"
        echo(f"{level}: {text}", err=True)


def keep_inputs(outputs: Iterable[Path | None], inputs: Iterable[Path]) -> None:
    """Refuse to write over what is read.

    Raises
    ------
    UserError
        If an output is an input, lies in a session folder, or is named twice.
    """
    kept = {path.resolve() for path in inputs}
    for output in outputs:
        if output is None:
            continue
        place = output.resolve()
        if output.is_dir():
            raise UserError(f"{output}: cannot be written (it is a folder)")
        if not place.parent.is_dir():
            raise UserError(f"{output}: cannot be written (there is no folder {output.parent})")
        if not os.access(place.parent, os.W_OK):
            raise UserError(f"{output}: cannot be written ({output.parent} is not writable)")
        if place in kept:
            raise UserError(f"{output}: is read or written already; name another file to write")
        if (place.parent / "manifest.json").exists():
            raise UserError(f"{output}: lies in a session folder, which is never written to again")
        kept.add(place)


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
