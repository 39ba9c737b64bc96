"""Compare conditions of whatever holds them: a study folder, estimates, or a table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidimeter.analysis.reading import read_estimates
from rigidimeter.analysis.reading.formats import READERS
from rigidimeter.analysis.study.any_table import Columns, table_study
from rigidimeter.analysis.study.comparisons import Progress
from rigidimeter.analysis.study.from_folder import analyse, load_study
from rigidimeter.analysis.study.measures import chosen_pair, off_first
from rigidimeter.analysis.study.results import TESTS_SHARE, StudyResult, conclude_study
from rigidimeter.analysis.study.rows import estimate_rows
from rigidimeter.analysis.study.study import Study
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_text_table
from rigidimeter.core.records import Analysis, Epoch, Fit, Score
from rigidimeter.core.settings import Settings, settings_from
from rigidimeter.core.study_files import is_study

if TYPE_CHECKING:
    import pandas as pd


def compare(
    x: str | PathLike[str] | Analysis | pd.DataFrame,
    other: str | None = None,
    *,
    reference: str | None = None,
    value: str | Sequence[str] | None = None,
    by: str = "condition",
    session: str | None = None,
    group: str | None = None,
    key: str | PathLike[str] | None = None,
    settings: Settings | str | Path | Mapping[str, Any] | None = None,
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
        The two conditions; differences are other − reference, but `shift`, `z`, `r` and the
        `estimate` by days, as documented, are reference − other. Where not given, those of the
        study, or the first two, ``OFF`` first. Without `other` each further condition is compared
        with the reference, too.
    value : str or sequence of str, optional
        Columns of the table to compare.
    by : str
        The table's column of conditions.
    session : str, optional
        The table's column whose labels the bootstrap resamples, and the days of the test where the
        table has no column `day`. By default each row, or each subject and day where the table's
        columns `subject` and `day` have several rows of one, such as one in each condition.
    group : str, optional
        Compare the subjects of this group alone, of the column `group` of the table, or of the
        study's table of sessions. Without it a difference is claimed only where each group shows
        it by itself.
    key : path, optional
        The blinding key of a study folder that is stored elsewhere.
    settings : Settings, path or mapping, optional
        Of a study folder, instead of those that its first session was recorded with.
    method : str
        Of a study folder: the estimator, instead of that of its ``study.toml``.
    seed, resamples : int
        Of the bootstrap.
    progress : callable
        Called with the share of the work that was done since, 1 in all.

    Raises
    ------
    UserError
        If there is nothing to compare, or a name is unknown.

    Examples
    --------
    >>> import pandas as pd, rigidimeter as rm
    >>> table = pd.DataFrame({"state": ["OFF", "ON"] * 6, "k": [1.8, 1.4, 1.7, 1.5] * 3})
    >>> result = rm.compare(table, value="k", by="state")
    >>> summaries = result.summaries("k")
    >>> summaries["OFF"].median, summaries["ON"].median
    (1.75, 1.45)
    """
    pair = (reference, other)
    path = Path(x) if isinstance(x, (str, PathLike)) else None
    share = 1.0
    if value is not None or not (isinstance(x, Analysis) or path):
        if path is None and not hasattr(x, "columns"):
            raise UserError(
                "compare takes a study folder, estimates, their JSON file, or a table; not "
                f"something of type {type(x).__name__}"
            )
        table: Any = x if path is None else read_text_table(path)
        study = table_study(table, Columns(_names(value), by, session), pair, group)
    elif path is not None and is_study(path):
        loaded = load_study(
            path,
            key=None if key is None else Path(key),
            settings=None if settings is None else settings_from(settings),
            method=method,
            pair=pair,
            group=group,
        )
        share = TESTS_SHARE
        study = analyse(loaded, progress=lambda done: progress((1.0 - share) * done))
    else:
        study = estimates_study(x if isinstance(x, Analysis) else Path(x), pair, group)
    return conclude_study(
        study, seed=seed, resamples=resamples, progress=lambda done: progress(share * done)
    )


def _names(value: str | Sequence[str] | None) -> list[str]:
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, Iterable) or not (listed := [str(name) for name in names]):
        raise UserError("a table needs value=, the column or columns to compare")
    return listed


def estimates_study(
    x: Analysis | Path,
    wanted: tuple[str | None, str | None] = (None, None),
    group: str | None = None,
    *,
    epochs: Sequence[Epoch] = (),
    settings: Settings | None = None,
) -> Study:
    """Return the study of estimates, of the conditions that are wanted: at least two are needed.

    Parameters
    ----------
    x : Analysis or path
        Estimates, or the JSON file of them.
    wanted : (str or None, str or None)
        Reference and other. Without `other` each further condition is compared, too.
    group : str, optional
        Estimates name none: it is refused.
    epochs, settings
        As `analysis_study`.

    Raises
    ------
    UserError
        If there are not two conditions, or a name is unknown.
    """
    if isinstance(x, Path) and (
        x.is_dir() or any(x.suffix.lower() in reader.suffixes for reader in READERS)
    ):
        raise UserError(
            f"{x} is neither a study folder nor a JSON file of estimates; for a recording give "
            "what estimate returns, for a table also value=, the columns to compare"
        )
    if group is not None:
        raise UserError(f"group {group}: estimates name no group; give a study folder or a table")
    analysis = x if isinstance(x, Analysis) else read_estimates(x)
    reference, _ = chosen_pair(conditions(analysis), wanted)
    return analysis_study(analysis, (reference, wanted[1]), epochs=epochs, settings=settings)


def conditions(analysis: Analysis) -> tuple[str, ...]:
    """Return the named conditions in order of appearance, ``OFF`` first where it occurs."""
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    return off_first(result.condition for result in results)


def analysis_study(
    analysis: Analysis,
    pair: tuple[str | None, str | None] = (None, None),
    *,
    epochs: Sequence[Epoch] = (),
    settings: Settings | None = None,
) -> Study:
    """Return the study of estimates that are of no study folder: each epoch is one value.

    Parameters
    ----------
    analysis : Analysis
    pair : (str or None, str or None)
        Reference and other; an `other` of ``""`` is one condition alone. Where not given, the first
        of `conditions`, and each other one.
    epochs : sequence of Epoch, optional
        That were analysed, for their order in time.
    settings : Settings, optional
        That they were analysed with.
    """
    names = conditions(analysis) or ("",)
    first = names[0] if pair[0] is None else pair[0]
    others = [name for name in names if name != first] if pair[1] is None else [pair[1]]
    return Study(
        estimate_rows({analysis.method or "none": analysis}, epochs=epochs),
        first,
        "".join(others[:1]),
        tuple(others[1:]),
        settings=settings or Settings(),
        partly_virtual=any(epoch.virtual for epoch in epochs),
        analysis=analysis,
    )
