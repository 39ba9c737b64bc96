"""`rigidimeter inspect`: what is in a file, and how it is read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.cli.inputs import keep_inputs, say
from rigidimeter.cli.options import Recordings, reads_recordings
from rigidimeter.cli.output import echo
from rigidimeter.cli.table_lines import text_table, wrapped
from rigidimeter.errors import UserError


@reads_recordings
def inspect(
    recordings: Recordings,
    write_mapping: Annotated[
        Path | None,
        typer.Option(
            "--write-mapping", metavar="FILE", help="Write a mapping file that reads the file."
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot", metavar="FILE", help="Draw the columns, as an image (.png, .svg, .pdf)."
        ),
    ] = None,
) -> None:
    """Show what is in a file and how it would be read, without estimating anything.

    The exit status is 1 if a file cannot be read without being told more.

    \b
    For example:
      rigidimeter inspect elbow.csv
      rigidimeter inspect elbow.csv --unit torque=Nm --write-mapping lab.toml
    """
    from rigidimeter.documents.writing import write_text
    from rigidimeter.recording.channels.inspection import command_for, inspect_table, option_words
    from rigidimeter.recording.channels.mapping_file import mapping_text
    from rigidimeter.recording.formats import read_table, reader_of
    from rigidimeter.recording.recording import read, read_options

    keep_inputs((write_mapping, plot), recordings.paths)
    if len(recordings.paths) > 1 and (write_mapping is not None or plot is not None):
        raise UserError("--write-mapping and --plot are for one file; name one")
    if recordings.join:
        raise UserError("--join: inspect looks at each file by itself; leave out --join")
    options = read_options(**recordings.of_files())
    status = 0
    for path in recordings.paths:
        try:
            if path.is_dir():
                recording = read(path)
                echo(f"{path}: {reader_of(path).name} with {len(recording.epochs)} epochs")
                say(recording.notices)
                echo(f"reads it: {command_for(path, [])}")
                continue
            table = read_table(path, options)
            found = inspect_table(table, options)
        except UserError as error:
            for line in error.lines:
                echo(f"error: {line}", err=True)
            status = 1
            continue
        rows = max((column.size for column in table.columns.values()), default=0)
        echo(f"{path}: {reader_of(path).name}, {len(table.columns)} columns of {rows} rows")
        _show(found)
        if found.proposal.unsaid:
            status = 1
        else:
            echo(f"reads it: {command_for(path, option_words(found))}")
        if write_mapping is not None:
            write_text(write_mapping, mapping_text(found.options))
        if plot is not None:
            from rigidimeter.reporting.inspected_columns import draw_columns

            draw_columns(found, plot)
    raise typer.Exit(status)


def _show(found: object) -> None:
    from rigidimeter.recording.channels.inspection import Inspection, column_rows, remarks

    assert isinstance(found, Inspection)
    for line in text_table(column_rows(found), "<<>>>><<", "  "):
        echo(f" {line}")
    for text in remarks(found):
        for line in wrapped(text, " "):
            echo(line)
    if found.proposal.unsaid:
        echo("only you can say:")
        for text in found.proposal.unsaid:
            echo(f" {text}")
