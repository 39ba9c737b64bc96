"""The help pages of all commands, with every option."""

from __future__ import annotations

from collections.abc import Iterator

from typer.testing import CliRunner

from rigidimeter.cli.main import app


def command_help() -> str:
    """Return a heading for each command and what its `--help-all` prints."""
    parts = []
    for words in _commands(app):
        found = CliRunner().invoke(app, [*words, "--help-all"], terminal_width=100)
        assert found.exit_code == 0, found.output
        text = "\n".join(line.rstrip() for line in found.output.strip().splitlines())
        parts.append(f"### `{' '.join(['rigidimeter', *words])}`\n\n```text\n{text}\n```\n")
    return "\n".join(parts)


def _commands(group: object) -> Iterator[list[str]]:
    from typer.main import get_command

    for name, command in get_command(group).commands.items():  # type: ignore[arg-type, attr-defined]
        below = getattr(command, "commands", None)
        if below:
            yield from ([name, each] for each in below)
        else:
            yield [name]
