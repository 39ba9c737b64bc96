"""`rigidimeter inspect`: what is in a file, and how it is read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rigidimeter.cli.help_pages import WRITE
from rigidimeter.cli.options import FULL
from rigidimeter.cli.output import echo, keep_inputs, say
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.cli.terminal_tables import Table, show
from rigidimeter.core.errors import UserError
from rigidimeter.core.words import with_error

if TYPE_CHECKING:
    from rigidimeter.analysis.reading.channels.inspection import Inspection
    from rigidimeter.analysis.reading.formats import ReadOptions


@reads_recordings
def inspect(
    recordings: Recordings,
    write_mapping: Path | None = WRITE.option(
        "--write-mapping FILE", "A mapping file that reads the file."
    ),
    plot: Path | None = WRITE.option("--plot FILE", "The columns as an image (.png, .svg, .pdf)."),
    full: bool = FULL,
) -> None:
    """Show what is in a file and how it would be read.

    Nothing is estimated. What only you can state, such as a unit, is listed. The exit status is 1
    if a file cannot be opened.

    \b
    For example:
      rigidimeter inspect demo-study/elbow.csv
      rigidimeter inspect demo-study/elbow.csv --write-mapping lab.toml
    """
    from rigidimeter.core.files import is_dictionary

    keep_inputs((write_mapping, plot), recordings.paths)
    named = [path for path in recordings.paths if not is_dictionary(path)] or recordings.paths
    several = len(named) > 1
    if several and (write_mapping is not None or (plot is not None and not recordings.join)):
        raise UserError("--write-mapping and --plot are for one file; name one")
    groups = [[*named]] if recordings.join else [[path] for path in named]
    status = 0
    for paths in groups:
        try:
            columns = full or len(groups) == 1
            _inspect(paths, recordings, write_mapping, plot, columns=columns)
        except UserError as error:
            for line in error.lines:
                echo(f"error: {line}", err=True)
            status = 1
    raise typer.Exit(status)


def _inspect(
    paths: list[Path],
    recordings: Recordings,
    write_mapping: Path | None,
    plot: Path | None,
    *,
    columns: bool,
) -> None:
    """Inspect one file, or the files of one recording.

    Without `columns` it is shown in a line and the command that reads it.
    """
    from rigidimeter.analysis.reading.channels.inspection import (
        command_for,
        inspect_table,
        option_words,
    )
    from rigidimeter.analysis.reading.channels.joining import join_tables, joined_options
    from rigidimeter.analysis.reading.channels.mapping_file import mapping_text
    from rigidimeter.analysis.reading.formats import Table, read_content, read_table, reader_of
    from rigidimeter.analysis.reading.recording import read_options
    from rigidimeter.core.files import write_text

    options = given = read_options(**recordings.of_files())
    name = " + ".join(map(str, paths))
    kind = " + ".join(dict.fromkeys(reader_of(path).name for path in paths))
    joining: list[str] = []
    if recordings.join:
        tables = [read_table(path, options) for path in paths]
        table, offset = join_tables(tables, options, recordings.asked_clock_offset)
        options = joined_options(options)
        joining = _joining_words(recordings, given)
        if offset is not None:
            echo(f"clock offset: {with_error(offset.value_s, offset.error_s)} s")
    else:
        content = read_content(paths[0], options)
        if not isinstance(content, Table):
            epochs, notices = content
            echo(f"{name}: {kind} with {len(epochs)} epochs")
            say(notices)
            echo(f"reads it: {command_for(paths, [])}")
            return
        table = content
    found = inspect_table(table, options)
    rows = max((column.size for column in table.columns.values()), default=0)
    echo(f"{name}: {kind}, {len(table.columns)} columns of {rows} rows")
    if columns:
        _show(found)
    elif found.proposal.unsaid:
        show([f"  only you can state: {'; '.join(found.proposal.unsaid)}"])
    if not found.proposal.unsaid:
        echo(f"reads it: {command_for(paths, [*option_words(found), *joining])}")
    if write_mapping is not None:
        write_text(write_mapping, mapping_text(found.options))
    if plot is not None:
        from rigidimeter.analysis.figures import draw_columns

        draw_columns(found, plot)


def _joining_words(recordings: Recordings, given: ReadOptions) -> list[str]:
    """Return the options that join files: those of their clocks, which the joined table has not."""
    words = ["--join"]
    for name, pairs in (("column", given.columns), ("unit", given.units)):
        for key, text in pairs.items():
            if key in ("time", "time_s"):
                words += [f"--{name}", f"{key}={text}"]
    if given.rate_hz is not None:
        words += ["--rate-hz", f"{given.rate_hz:g}"]
    if recordings.clock_offset is not None:
        words += ["--clock-offset", recordings.clock_offset]
    return words


def _show(found: Inspection) -> None:
    from rigidimeter.analysis.reading.channels.inspection import column_rows, remarks

    headings, *rows = column_rows(found)
    show([Table(headings, rows, "<<>>>><<"), *(f" {text}" for text in remarks(found))])
    if found.proposal.unsaid:
        show(["only you can state:", *(f" {text}" for text in found.proposal.unsaid)])
