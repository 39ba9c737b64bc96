"""`rigidimeter compare`: two conditions side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from rigidimeter.cli.help_pages import COMPARE, ESTIMATE
from rigidimeter.cli.options import CSV, FULL, GROUP, JSON, KEY
from rigidimeter.cli.output import echo, keep_inputs, say
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.cli.terminal_tables import show
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.analysis.study import StudyResult


@reads_recordings
def compare(
    recordings: Recordings,
    reference: str | None = COMPARE.option(
        "--reference NAME",
        "Reference condition. Default: OFF if there is one, else the first. Differences are "
        "other minus reference; shift and estimate in the files are reference minus other.",
    ),
    other: str | None = COMPARE.option(
        "--other NAME",
        "The other condition. Default: the next one, and each further one is compared with the "
        "first, too.",
    ),
    json_out: Path | None = JSON,
    csv_out: Path | None = CSV,
    value: list[str] | None = COMPARE.option(
        "--value COLUMN", "Compare this column of one CSV table. Repeat for several."
    ),
    by: str = COMPARE.option("--by COLUMN", "With --value: column of conditions.", "condition"),
    session: str | None = COMPARE.further(
        "--session COLUMN",
        "With --value: the bootstrap resamples the labels of this column, and they are days where "
        "there is no column `day`. Default: rows, or days where several rows are of one.",
    ),
    group: str | None = GROUP,
    seed: int = ESTIMATE.further("--seed N", "Seed of the bootstrap.", 1, min=0),
    resamples: int = ESTIMATE.further(
        "--resamples N", "Resamples of the bootstrap.", 9999, min=100
    ),
    key: Path | None = KEY,
    full: bool = FULL,
) -> None:
    """Compare conditions in J, B, K, angular impulse and work.

    Median and quartiles, the two-sided Wilcoxon rank-sum test (asymptotic, ties and continuity
    corrected), effect size r = z/√N, and the Hodges-Lehmann shift with its 95 % interval. Effect
    sizes have bootstrap intervals, and each pair of measures is compared in how well it separates
    the conditions. Inputs are session folders, recordings, or one JSON file from
    `rigidimeter estimate`.

    A study folder (with a study.toml) also has tests by days, the examiners' ratings, other methods
    and every exclusion; its analysis is stored in its folder `analysis`.

    With --value the input is one table as CSV. Where its columns `subject` and `day` have several
    rows of one, such as one in each condition, it is tested by days.

    \b
    For example:
      rigidimeter compare demo-study
      rigidimeter compare demo-study/sessions/day-1-OFF \\
          demo-study/sessions/day-1-DBS
      rigidimeter compare demo-study/analysis/estimates.json --reference DBS
      rigidimeter compare demo-study/ratings.csv --value score --by condition
    """
    from rigidimeter.analysis import study as studies
    from rigidimeter.analysis.report import Shown
    from rigidimeter.cli.comparison_text import comparison_blocks
    from rigidimeter.cli.inputs import Analysed, analyse_recordings, study_of
    from rigidimeter.cli.study_inputs import analyse_study_folder, study_files

    outputs, paths, pair = (json_out, csv_out), recordings.paths, (reference, other)
    is_json = any(path.suffix.lower() == ".json" for path in paths)
    if value and len(paths) != 1:
        raise UserError(f"--value takes one table, but {len(paths)} inputs were given")
    how: dict[str, Any] = {"seed": seed, "resamples": resamples}
    folder = None if value else study_of(recordings, key)
    keep_inputs(outputs, paths if folder is None else study_files(folder, key))
    read, analysed = None, Analysed()
    if folder is not None:
        shown, analysed = analyse_study_folder(
            folder, recordings, key, pair=pair, group=group, recordings_shown=full, **how
        )
    elif is_json and not value and len(paths) > 1:
        raise UserError("compare takes one JSON file of estimates, or recordings, not both")
    elif not (value or is_json):
        read, analysed = analyse_recordings(recordings)
    try:
        if folder is None:
            with Meter("compare", 1.0) as meter:
                how |= {"progress": meter.advance}
                if read is None:
                    how |= {"value": value, "by": by, "session": session, "group": group}
                    found = studies.compare(paths[0], other, reference=reference, **how)
                else:
                    study = studies.estimates_study(
                        analysed.analysis, pair, group, epochs=read.epochs, settings=read.settings
                    )
                    found = studies.conclude_study(study, **how)
            shown = Shown(found, () if read is None else read.epochs)
        _write(shown.result, *outputs, "" if folder is None else str(folder))
        show(comparison_blocks(shown, full=full))
        _say_changes(shown.changes)
        if folder is None:
            say(shown.result.notices)
        elif group is None and not analysed.not_kept:
            echo(f"\nTables and JSON: {folder / 'analysis'}; most tables here: --full")
    finally:
        status = analysed.say()
    raise typer.Exit(status)


def _write(
    found: StudyResult, json_out: Path | None, csv_out: Path | None, place: str = ""
) -> None:
    from rigidimeter.analysis.study import (
        columns_of_rows,
        comparison_document,
        result_table,
        table_csv,
    )
    from rigidimeter.core.files import write_dictionary_beside, write_json, write_text

    if json_out is not None:
        write_json(json_out, comparison_document(found, place))
    if csv_out is not None:
        rows = result_table(found, "comparisons")
        write_text(csv_out, table_csv(rows))
        write_dictionary_beside(csv_out, "comparisons", columns_of_rows(rows))


def _say_changes(changes: Sequence[str]) -> None:
    from rigidimeter.analysis.study import UNCHANGED

    if changes and changes != (UNCHANGED,):
        echo("\nSince the last analysis:")
        for change in changes:
            echo(f"  {change}")
