"""Compare two conditions of whatever holds them: a study folder, estimates, or a table."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidimeter.errors import UserError
from rigidimeter.estimation.method_record import Progress
from rigidimeter.recording import read_estimates
from rigidimeter.recording.formats import TextTable, read_text_table
from rigidimeter.recording.study_folder import is_study
from rigidimeter.records import Analysis
from rigidimeter.settings import Settings
from rigidimeter.study.columns import compare_columns
from rigidimeter.study.comparison import compare_analysis, conditions
from rigidimeter.study.results import StudyResult
from rigidimeter.study.study_analysis import analyse_study, read_study

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["chosen_pair", "compare"]


def compare(
    x: str | PathLike[str] | Analysis | pd.DataFrame,
    other: str | None = None,
    *,
    reference: str | None = None,
    value: str | Sequence[str] | None = None,
    by: str = "condition",
    session: str | None = None,
    key: str | PathLike[str] | None = None,
    settings: Settings | None = None,
    method: str = "auto",
    seed: int = 1,
    resamples: int = 9999,
    progress: Progress = lambda _: None,
) -> StudyResult:
    """Compare two conditions: medians, rank-sum tests, shifts, effect sizes.

    Parameters
    ----------
    x : path, Analysis or pandas.DataFrame
        A study folder, which adds tests by days, ratings and other methods; estimates, or the JSON
        file of them; or a table, or the CSV file of one, with `value` and `by`.
    other, reference : str, optional
        The two conditions; differences are reference − other. Where not given, those of the study,
        or the only two, ``OFF`` first.
    value : str or sequence of str, optional
        Columns of the table to compare.
    by : str
        The table's column of conditions.
    session : str, optional
        The table's column whose labels the bootstrap resamples; by default each row.
    key : path, optional
        The blinding key of a study folder that is kept elsewhere.
    settings : Settings, optional
        Of a study folder, instead of those that its first session was recorded with.
    method : str
        Of a study folder: the estimator, instead of that of its ``study.toml``.
    seed, resamples : int
        Of the bootstrap.
    progress : callable
        Called with the share of the work on a study folder that was done since, 1 in all.

    Raises
    ------
    UserError
        If there is nothing to compare, or a name is unknown.
    """
    if isinstance(x, Analysis):
        pair = chosen_pair(conditions(x), reference, other)
        return compare_analysis(x, *pair, seed=seed, resamples=resamples)
    path = Path(x) if isinstance(x, (str, PathLike)) else None
    if path is None or value is not None:
        table = _as_text(x) if path is None else read_text_table(path)
        wanted = (reference, other)
        return compare_columns(
            table, _names(value), by, wanted, session=session, seed=seed, resamples=resamples
        )
    if is_study(path):
        read = read_study(
            path, key=None if key is None else Path(key), settings=settings, method=method,
            pair=(reference, other),
        )  # fmt: skip
        return analyse_study(read, seed=seed, resamples=resamples, progress=progress)
    analysis = read_estimates(path)
    pair = chosen_pair(conditions(analysis), reference, other)
    return compare_analysis(analysis, *pair, seed=seed, resamples=resamples)


def chosen_pair(
    known: Sequence[str], reference: str | None, other: str | None
) -> tuple[str | None, str | None]:
    """Return the conditions to compare if the names are good.

    Raises
    ------
    UserError
        If a name is unknown, both are one, or it is not clear which two are meant.
    """
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
    return reference, other


def _names(value: str | Sequence[str] | None) -> list[str]:
    if value is None:
        raise UserError("a table needs value=, the column or columns to compare")
    return [value] if isinstance(value, str) else list(value)


def _as_text(table: Any) -> TextTable:
    """Return a table of pandas as text, its rows numbered as in a file with one header line."""
    columns = {
        str(name): tuple("" if missing else str(cell) for cell, missing in zip(
            table[name], table[name].isna(), strict=True))
        for name in table.columns
    }  # fmt: skip
    return TextTable("the table", columns, tuple(range(2, len(table) + 2)))
