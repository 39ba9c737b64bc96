"""`rigidimeter ratings`: examiners' scores, their offsets, and the contrast of two conditions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.cli.help_pages import OPTIONS, argument
from rigidimeter.cli.options import FULL, JSON
from rigidimeter.cli.output import keep_inputs, say
from rigidimeter.cli.terminal_tables import Block, Heading, Table, show
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.analysis.study import Ratings

MOST_OFFSETS, MOST_PAIRS = 6, 3
"""On the first screen."""


def ratings(
    table: Path = argument("FILE", "CSV file with one rating a row."),
    json_out: Path | None = JSON,
    condition: str = OPTIONS.option("--condition COLUMN", "Column of the condition.", "condition"),
    score: str = OPTIONS.option("--score COLUMN", "Column of the rating.", "score"),
    examiner: str = OPTIONS.option("--examiner COLUMN", "Column of the examiner.", "examiner"),
    subject: str = OPTIONS.option("--subject COLUMN", "Column of the subject.", "subject"),
    day: str = OPTIONS.option("--day COLUMN", "Column of the day.", "day"),
    random: list[str] | None = OPTIONS.option(
        "--random NAME",
        "Random offset, as examiner; repeat for several. Also day, day/condition, subject and "
        "subject/day. Default: examiner, and the days of one subject.",
    ),
    scale: tuple[float, float] = OPTIONS.option(
        "--scale LOW HIGH", "Lowest and highest rating.", (0.0, 3.0)
    ),
    step: float = OPTIONS.option("--step STEP", "Step of the scale; 0 for none.", 0.5),
    contrast: tuple[str, str] | None = OPTIONS.option(
        "--contrast A B",
        "Test A minus B. Default: the second minus the first condition of the file, OFF being "
        "first where it occurs.",
    ),
    full: bool = FULL,
) -> None:
    """Model ratings by several examiners, each with an offset.

    A linear mixed model by restricted maximum likelihood (Sec. 2.2 of the paper): condition means
    without intercept, random offsets. The contrast of two conditions is tested with residual
    degrees of freedom (n − p, as the paper's software does), with Satterthwaite's and with Kenward
    and Roger's. Corrected scores are the scores minus the offsets.

    \b
    For example:
      rigidimeter ratings demo-study/ratings.csv --json ratings.json
      rigidimeter ratings demo-study/ratings.csv --scale 0 4 --step 0.5
    """
    from rigidimeter.analysis.study import ratings_document, table_ratings
    from rigidimeter.core.files import read_text_table, write_json
    from rigidimeter.core.records import Notice
    from rigidimeter.core.study_files import is_study, table_path

    if is_study(table):
        path = table_path(table, "ratings")
        raise UserError(
            f"{table} is a study folder: `rigidimeter compare {table}` models its ratings with the "
            f"rest; for the ratings alone give their table, {path}"
        )
    keep_inputs((json_out,), (table,))
    names = ("condition", "score", "examiner", "subject", "day")
    columns = dict(zip(names, (condition, score, examiner, subject, day), strict=True))
    found, pair = table_ratings(
        read_text_table(table), columns, random, scale=scale, step=step, contrast=contrast
    )
    say(tuple(Notice("warning", text) for text in found.notices))
    if json_out is not None:
        write_json(json_out, ratings_document(found, pair))
    show(_blocks(found, pair, full))


def _blocks(found: Ratings, pair: tuple[str, str], full: bool) -> Iterator[Block]:
    """Yield the table and its sentences; with `full` every offset and every pair."""
    from rigidimeter.analysis.study import rating_offsets, ratings_document

    document, fit = ratings_document(found, pair), found.fit
    by_day = any("day" in name for name in fit.variances)
    offsets = " + ".join(f"offset of {name}" for name in fit.variances)
    yield Heading(f"{found.source}: {fit.n} ratings in {len(fit.conditions)} conditions")
    yield f"score = mean of condition + {offsets} + error, fitted by REML"
    counts, means, errors = (document[name] for name in ("counts", "means", "means_se"))
    rows = [
        (name, f"{counts[name]}", f"{means[name]:.4f}", f"{errors[name]:.4f}") for name in means
    ]
    yield from ("", Table(("condition", "n", "mean", "SE"), rows, "<>>>"))
    for group, each in groupby(rating_offsets(found), lambda row: row["grouping"]):
        groups = [(row["name"], f"{row['ratings']}", f"{row['offset']:.4f}") for row in each]
        if full or len(groups) <= MOST_OFFSETS:
            yield from ("", Table((group, "n", "offset"), groups, "<>>"))
        else:
            yield from ("", f"{len(groups)} offsets of {group}: --full")
        yield _variance(group, fit.variances[group])
    yield _variance("the residual", fit.variance_residual)
    yield ""
    yield from _contrast(found, pair, by_day=by_day)
    if len(fit.conditions) > 2:
        contrasts = document["contrasts"]
        yield from ("", f"{len(contrasts)} pairs (p unadjusted; Holm's are in the JSON file):")
        key, name = ("kenward_roger", "Kenward and Roger") if by_day else ("residual", "residual")
        for c in contrasts if full else contrasts[:MOST_PAIRS]:
            yield (
                f"  {c['first']} minus {c['second']}: {c['estimate']:.4g}, SE {c['se']:.4g}, "
                f"p {c[f'p_{key}']:.3g} ({name}), {c['p_satterthwaite']:.3g} (Satterthwaite)"
            )
        j = document["joint"]
        df, f = j["df_numerator"], j["f"]
        yield (
            f"All means equal: F({df}, {j['df_residual']:.4g}) = {f:.4g}, "
            f"p = {j['p_residual']:.3g}; Satterthwaite F({df}, {j['df_satterthwaite']:.4g}), "
            f"p = {j['p_satterthwaite']:.3g}"
        )
    yield from ("", "Corrected score = score minus the offsets of its groups.")
    if found.model_notices:
        yield from ("", "Note:", *(f"  - {text}" for text in found.model_notices))


def _variance(name: str, variance: float) -> str:
    return f"Variance of {name}: {variance:.4g} (SD {math.sqrt(variance):.4g})."


def _contrast(found: Ratings, pair: tuple[str, str], *, by_day: bool) -> Iterator[Block]:
    from rigidimeter.analysis.study import rating_contrast

    second, first = pair
    names = ("residual degrees of freedom, n − p", "Satterthwaite", "Kenward and Roger")
    choices = [*zip(rating_contrast(found, pair), names, strict=False)]
    choices = choices[::-1] if by_day else choices
    c, _ = choices[0]
    low, high, size = c["low"], c["high"], c["estimate"]
    way = "higher" if size > 0 else "lower" if size < 0 else "neither higher nor lower"
    yield f"{first} minus {second}: {size:.4g} [{low:.4g} to {high:.4g}, 95 %], SE {c['se']:.4g}"
    for row, name in choices:
        yield f"  F(1, {row['df']:.4g}) = {row['f']:.4g}, p = {row['p']:.3g}   {name}"
    if by_day:
        yield "The interval is Kenward and Roger's: with few days n − p is too many."
    yield f"{first} was rated {way} than {second}; a positive difference means {first} is higher."
