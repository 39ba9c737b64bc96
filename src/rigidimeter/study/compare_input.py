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
from rigidimeter.study.comparison import compare_analysis
from rigidimeter.study.measures import chosen_pair, conditions
from rigidimeter.study.results import StudyResult
from rigidimeter.study.study_analysis import analyse_study, read_study

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["compare"]


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
    wanted = (reference, other)
    path = Path(x) if isinstance(x, (str, PathLike)) else None
    if value is not None or not (isinstance(x, Analysis) or path):
        table = _as_text(x) if path is None else read_text_table(path)
        return compare_columns(
            table, _names(value), by, wanted, session=session, seed=seed, resamples=resamples
        )
    if path is not None and is_study(path):
        secret = None if key is None else Path(key)
        read = read_study(path, key=secret, settings=settings, method=method, pair=wanted)
        return analyse_study(read, seed=seed, resamples=resamples, progress=progress)
    analysis = x if isinstance(x, Analysis) else read_estimates(Path(x))
    pair = chosen_pair(conditions(analysis), wanted)
    return compare_analysis(analysis, *pair, seed=seed, resamples=resamples)


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
