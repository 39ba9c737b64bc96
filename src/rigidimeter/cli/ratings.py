"""`rigidimeter ratings`: examiners' scores, their offsets, and the contrast of two conditions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rigidimeter.cli.inputs import keep_inputs, say
from rigidimeter.errors import UserError

__all__ = ["ratings"]


def ratings(
    table: Annotated[
        Path, typer.Argument(metavar="FILE", help="A table as CSV.", show_default=False)
    ],
    json_out: Annotated[
        Path | None, typer.Option("--json", metavar="OUT", help="Write the numbers as JSON.")
    ] = None,
    condition: Annotated[
        str, typer.Option("--condition", metavar="COLUMN", help="Column of the condition.")
    ] = "condition",
    score: Annotated[
        str, typer.Option("--score", metavar="COLUMN", help="Column of the rating.")
    ] = "score",
    examiner: Annotated[
        str, typer.Option("--examiner", metavar="COLUMN", help="Column of the examiner.")
    ] = "examiner",
    subject: Annotated[
        str, typer.Option("--subject", metavar="COLUMN", help="Column of the subject.")
    ] = "subject",
    day: Annotated[
        str,
        typer.Option("--day", metavar="COLUMN", help="Column of the day; one label is one day."),
    ] = "day",
    random: Annotated[
        list[str] | None,
        typer.Option(
            "--random",
            metavar="examiner|subject|subject/day",
            help="What has a random offset; default: examiner. Repeat for several.",
        ),
    ] = None,
    scale: Annotated[
        tuple[float, float],
        typer.Option("--scale", metavar="LOW HIGH", help="Lowest and highest rating there is."),
    ] = (0.0, 3.0),
    step: Annotated[
        float, typer.Option("--step", metavar="STEP", help="Steps of the scale; 0 for none.")
    ] = 0.5,
    contrast: Annotated[
        tuple[str, str] | None,
        typer.Option(
            "--contrast",
            metavar="A B",
            help="Test A minus B. Default: the first two conditions in the file's order, OFF first "
            "where it occurs.",
        ),
    ] = None,
) -> None:
    """Model ratings by several examiners: a mean for each condition, an offset for each examiner.

    A linear mixed model by restricted maximum likelihood (Sec. 2.2 of the paper): condition means
    without intercept, random offsets. The contrast of two conditions is tested with residual
    degrees of freedom (n − p, as the paper's software does), with Satterthwaite's and with Kenward
    and Roger's. Corrected scores are the scores less the offsets.

    \b
    For example:
      rigidimeter ratings ratings.csv --json ratings.json
      rigidimeter ratings ratings.csv --score updrs --examiner rater --scale 0 4 --step 1
      rigidimeter ratings ratings.csv --random subject/day --contrast OFF DBS
    """
    from rigidimeter.cli.ratings_show import model_notices, ratings_document, ratings_lines
    from rigidimeter.documents import write_json
    from rigidimeter.recording.formats import read_text_table
    from rigidimeter.records import Notice
    from rigidimeter.statistics import fit_mixed
    from rigidimeter.study.rating_table import RANDOM, groupings, ratings_of

    keep_inputs((json_out,), (table,))
    chosen = tuple(dict.fromkeys(random or ["examiner"]))
    for name in chosen:
        if name not in RANDOM:
            raise UserError(f"--random {name}: must be one of {', '.join(RANDOM)}")
    if not (scale[0] < scale[1] and step >= 0 and abs(sum(scale)) < float("inf")):
        raise UserError(
            f"--scale {scale[0]:g} {scale[1]:g} --step {step:g}: write the lowest and then the "
            "highest rating, and a step of 0 or more"
        )
    columns = {
        "condition": condition,
        "score": score,
        "examiner": examiner,
        "subject": subject,
        "day": day,
    }
    read = read_text_table(table)
    found = ratings_of(read, columns, chosen, scale, step)
    conditions = [row.condition for row in found.rows]
    pair = contrast or _first_two(conditions)
    for name in pair:
        if name not in conditions:
            known = ", ".join(dict.fromkeys(conditions))
            raise UserError(f"--contrast {name}: there is no such condition; rated are: {known}")
    if pair[0] == pair[1]:
        raise UserError(f"--contrast {pair[0]} {pair[1]}: name two different conditions")
    try:
        fit = fit_mixed(
            [row.score for row in found.rows], conditions, groupings(found.rows, chosen)
        )
    except (ValueError, ArithmeticError) as error:
        raise UserError(f"{read.source}: {error}") from None
    of_model = model_notices(fit)
    say(tuple(Notice("warning", text) for text in found.notices))
    if json_out is not None:
        notices = [*found.notices, *of_model]
        write_json(json_out, ratings_document(read.source, found, fit, pair, notices))
    typer.echo("\n".join(ratings_lines(read.source, found, fit, pair, of_model)))


def _first_two(conditions: list[str]) -> tuple[str, str]:
    """Return the first two conditions in order of appearance, ``OFF`` first where it occurs."""
    first, second, *_ = sorted(dict.fromkeys(conditions), key=lambda name: name != "OFF")
    return first, second
