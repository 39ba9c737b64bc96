"""`rigidimeter compare`: two conditions side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rigidimeter.cli.compare_show import comparison_document, comparison_lines
from rigidimeter.cli.compare_table import compare_table
from rigidimeter.cli.inputs import Recordings, analyse_inputs, keep_inputs, say, status
from rigidimeter.cli.options import reads_recordings
from rigidimeter.cli.study.study_input import KeyOption, analysed_study, study_files, study_of
from rigidimeter.cli.study.study_text import study_lines
from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.cli.study.study_input import Analysed
    from rigidimeter.study import Comparison

__all__ = ["COMPARISONS_SCHEMA", "compare"]

COMPARISONS_SCHEMA = "rigidimeter.comparisons/1"


@reads_recordings
def compare(
    recordings: Recordings,
    reference: Annotated[
        str | None,
        typer.Option("--reference", metavar="NAME", help="Condition to compare with."),
    ] = None,
    other: Annotated[
        str | None, typer.Option("--other", metavar="NAME", help="Condition that is compared.")
    ] = None,
    json_out: Annotated[
        Path | None, typer.Option("--json", metavar="OUT", help="Write the numbers as JSON.")
    ] = None,
    csv_out: Annotated[
        Path | None, typer.Option("--csv", metavar="OUT", help="Write the table as CSV.")
    ] = None,
    value: Annotated[
        list[str] | None,
        typer.Option(
            "--value",
            metavar="COLUMN",
            help="Compare this column of one table instead; repeat for several.",
        ),
    ] = None,
    by: Annotated[
        str, typer.Option("--by", metavar="COLUMN", help="The table's column of groups.")
    ] = "condition",
    session: Annotated[
        str | None,
        typer.Option(
            "--session",
            metavar="COLUMN",
            help="Column whose labels the bootstrap resamples; by default each row.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, metavar="N", help="Of the bootstrap.")] = 1,
    resamples: Annotated[
        int, typer.Option("--resamples", min=100, metavar="N", help="Of the bootstrap.")
    ] = 9999,
    key: KeyOption = None,
) -> None:
    """Compare two conditions in J, B, K, angular impulse and work, or in columns of a table.

    Median and quartiles, the two-sided Wilcoxon rank-sum test (asymptotic, ties and continuity
    corrected), effect size r = z/√N, and the Hodges-Lehmann shift with its 95 % interval. Inputs
    are session folders, recordings, or one JSON file that `rigidimeter estimate` wrote.

    A study folder (with a study.toml) adds tests in which days count, effect sizes, the examiners'
    ratings, other methods and every exclusion, and keeps the analysis in its folder analysis.

    With --value the input is one table as CSV. Then r and the rank-biserial correlation have
    bootstrap intervals, several columns are adjusted by Holm, and every two are compared in how
    well they part the groups.

    \b
    For example:
      rigidimeter compare demo-study/sessions/day-1 demo-study/sessions/day-2
      rigidimeter compare study
      rigidimeter compare before.csv after.csv --condition OFF --condition DBS
      rigidimeter compare estimates.json --reference OFF --other DBS --csv table.csv
      rigidimeter compare ratings.csv --value score --by condition --json comparison.json
    """
    if value:
        _compare_columns(
            recordings, value, by, (reference, other), session, seed, resamples, json_out, csv_out
        )
        return
    if (folder := study_of(recordings, key)) is not None:
        keep_inputs((json_out, csv_out), study_files(folder, key))
        found = analysed_study(
            folder, recordings, key, pair=(reference, other), seed=seed, resamples=resamples
        )
        _write_study(found, folder, json_out, csv_out)
        typer.echo("\n".join([*_lines(found.study.comparisons), *study_lines(found.cohort)]))
        _say_changes(found, folder)
        raise typer.Exit(found.status)
    from rigidimeter.documents import write_json, write_text
    from rigidimeter.recording import read_estimates
    from rigidimeter.reporting import csv_text, results_table
    from rigidimeter.study import compare as compare_analysis
    from rigidimeter.study import comparison_row, conditions

    keep_inputs((json_out, csv_out), recordings.paths)
    exit_status = 0
    if any(path.suffix.lower() == ".json" for path in recordings.paths):
        if len(recordings.paths) > 1:
            raise UserError("compare takes one JSON file of estimates, or recordings, not both")
        analysis = read_estimates(recordings.paths[0])
    else:
        read = recordings.read()
        say(read.notices)
        analysis = analyse_inputs(read, recordings.method)
        exit_status = status(read, analysis)
    known = conditions(analysis)
    for option, name in (("--reference", reference), ("--other", other)):
        if name is not None and name not in known:
            listed = ", ".join(known) or "none"
            raise UserError(f"{option} {name}: there is no such condition; recorded are: {listed}")
    if reference is not None and reference == other:
        raise UserError(f"--reference and --other are both {reference}; name two conditions")
    if len(known) > 2 and (reference is None or other is None):
        raise UserError(
            f"there are {len(known)} conditions ({', '.join(known)}); choose two with "
            "--reference and --other"
        )
    if len(known) < 2:
        listed = known[0] if known else "none is named"
        raise UserError(
            f"a comparison needs two conditions, but the recordings hold one ({listed}); name them "
            "in a condition column, or give --condition once for each file in their order"
        )
    comparisons = compare_analysis(analysis, reference, other)
    if json_out is not None:
        write_json(
            json_out,
            {
                "schema": COMPARISONS_SCHEMA,
                "method": analysis.method,
                "comparisons": [comparison_row(comparison) for comparison in comparisons],
            },
        )
    if csv_out is not None:
        write_text(csv_out, csv_text(results_table(comparisons)))
    typer.echo("\n".join(_lines(comparisons)))
    raise typer.Exit(exit_status)


def _compare_columns(
    recordings: Recordings,
    values: list[str],
    by: str,
    pair: tuple[str | None, str | None],
    session: str | None,
    seed: int,
    resamples: int,
    json_out: Path | None,
    csv_out: Path | None,
) -> None:
    from rigidimeter.documents import write_json
    from rigidimeter.records import Notice

    if len(recordings.paths) != 1:
        raise UserError(f"--value takes one table, but {len(recordings.paths)} inputs were given")
    if csv_out is not None:
        raise UserError("--csv is not written with --value; use --json")
    keep_inputs((json_out,), recordings.paths)
    found = compare_table(recordings.paths[0], values, by, pair, session, seed, resamples)
    say(tuple(Notice("warning", notice) for notice in found.notices))
    if json_out is not None:
        write_json(json_out, comparison_document(found))
    typer.echo("\n".join(comparison_lines(found)))


def _write_study(
    found: Analysed, folder: Path, json_out: Path | None, csv_out: Path | None
) -> None:
    from rigidimeter.documents import write_json, write_text
    from rigidimeter.reporting import csv_text, results_table
    from rigidimeter.study import study_document

    if json_out is not None:
        write_json(json_out, study_document(found.study, found.cohort, str(folder)))
    if csv_out is not None:
        write_text(csv_out, csv_text(results_table(found.study.comparisons)))


def _say_changes(found: Analysed, folder: Path) -> None:
    typer.echo("")
    if found.cohort.changes:
        typer.echo("Since the last analysis:")
    for change in found.cohort.changes:
        typer.echo(f"  {change}")
    if found.kept:
        typer.echo(f"{folder / 'analysis'}: estimates.json, comparison.json and tables")


def _lines(comparisons: tuple[Comparison, ...]) -> list[str]:
    lines = ["Wilcoxon rank-sum test, two-sided, asymptotic, tie and continuity corrected", ""]
    for c in comparisons:
        lines.append(f"{c.title} ({c.unit})")
        for name in filter(None, (c.reference, c.other)):
            s = c.summaries[name]
            lines.append(
                f"  {name:>10}: n {s.n:3d}, excluded {c.excluded[name]:2d}, median {s.median:.4g} "
                f"[{s.q1:.4g} to {s.q3:.4g}]"
            )
        if c.test is None:
            lines.append(f"  no test: {c.remark}")
        else:
            t = c.test
            lines.append(
                f"  {c.reference} − {c.other}: shift {t.shift:.4g} "
                f"[{t.shift_low:.4g} to {t.shift_high:.4g}]{'' if t.shift_bounded else ' †'}, "
                f"z {t.z:.3f}, p {t.p:.2g}, r {t.r:.3f}"
            )
    if any(c.test is not None and not c.test.shift_bounded for c in comparisons):
        lines += [
            "",
            "† Too few epochs for an interval at this confidence: the smallest and the largest",
            "  difference stand in its place.",
        ]
    return lines
