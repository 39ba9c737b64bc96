"""`batch`: thousands of recordings to one table, each estimated once."""

from __future__ import annotations

import gc
import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rigidimeter.analysis.batch.archive_inputs import (
    Input,
    content_bytes,
    content_digest,
    digest_or_nothing,
    inputs_of,
)
from rigidimeter.analysis.batch.epoch_rows import How, answer, refusal
from rigidimeter.analysis.batch.epoch_table import ENDINGS, columns, read_table, write_table
from rigidimeter.analysis.batch.parts import Parts, Row
from rigidimeter.analysis.estimation import method_names, no_such_method
from rigidimeter.analysis.reading.recording import read_options
from rigidimeter.core.errors import UserError
from rigidimeter.core.executor import each
from rigidimeter.core.extensions import loaded
from rigidimeter.core.settings import Settings, changed_settings, settings_from
from rigidimeter.core.version import __version__

if TYPE_CHECKING:
    import pandas as pd

INPUT_BYTES = 50_000
"""What an input takes of the time beside that of its own bytes, in bytes."""


@dataclass(frozen=True)
class BatchResult:
    """What a batch wrote.

    Attributes
    ----------
    path : Path
        Of the table.
    inputs, epochs : int
        How many there were, and how many epochs they gave.
    before : int
        Inputs that had been estimated before, with the same content, settings and version.
    failed : tuple of str
        Why inputs, or parts of them, gave nothing: one sentence each.
    lost_workers : tuple of str
        What ended before the work did: addresses in a cluster, or a process of this machine.
    """

    path: Path
    inputs: int
    epochs: int
    before: int
    failed: tuple[str, ...]
    lost_workers: tuple[str, ...] = ()

    def table(self) -> pd.DataFrame:
        """Return the rows as a pandas table."""
        import pandas as pd

        return pd.DataFrame(read_table(self.path), columns=[*columns()])


def batch(
    inputs: str | Path | Sequence[str | Path],
    out: str | Path,
    *,
    method: str = "auto",
    jobs: int = 1,
    scheduler: str = "",
    condition: str = "",
    settings: Settings | str | Path | Mapping[str, Any] | None = None,
    changes: Mapping[str, Any] | None = None,
    progress: Callable[[float], None] = lambda _: None,
    **reading: Any,
) -> BatchResult:
    """Estimate every epoch of many recordings, and write a table of them.

    Each recording is estimated on its own, as `estimate` does it. One that fails is a row with the
    reason. What was estimated before with the same content, settings and version, and is in the
    table or beside it in ``OUT.parts``, is not estimated again.

    Parameters
    ----------
    inputs : path or sequence of paths
        Recordings, session folders, study folders, folders of these, patterns such as ``**/*.csv``.
    out : path
        The table, ``.parquet`` or ``.csv``.
    method : str
        The name of an estimator; ``auto`` chooses for each recording by what was recorded.
    jobs : int
        Processes on this machine.
    scheduler : str
        The address of a Dask scheduler, instead of `jobs`. Its workers must find the inputs under
        the same absolute paths.
    condition : str
        Of recordings that do not say one.
    settings : Settings, path or mapping, optional
        Instead of those that a recording was made with.
    changes : mapping, optional
        Values of settings that differ from those of each recording.
    progress : callable
        Called with the share of the work that is done.
    **reading
        What recordings do not say of themselves, named as in `read`: `column`, `unit`, `mapping`.

    Returns
    -------
    BatchResult

    Raises
    ------
    UserError
        If an argument is wrong, there is no input, or the table cannot be written.

    Examples
    --------
    >>> import rigidimeter as rm
    >>> session = {"prbs": {"duration_s": 6.0}, "protocol": {"blocks": [{"epochs": 1}]}}
    >>> for seed in (1, 2):
    ...     _ = rm.simulate(session, f"sessions/{seed}", seed=seed)
    >>> found = rm.batch("sessions", "all.csv")
    >>> found.inputs, found.epochs
    (2, 2)
    """
    place = Path(out)
    if place.suffix not in ENDINGS:
        raise UserError(f"--out {place}: must end in {' or '.join(ENDINGS)}")
    if jobs < 1:
        raise UserError(f"--jobs {jobs}: must be at least 1")
    how = _how(method, condition, settings, changes or {}, reading)
    beside = place.with_name(f"{place.name}.parts")
    named = [inputs] if isinstance(inputs, str | Path) else inputs
    listed = [*inputs_of(named, (place, beside))]
    if not listed:
        raise UserError("no input is named")
    with Parts(beside) as parts:
        _take_over(place, parts)
        work = _Work(listed, how, parts)
        lost: list[str] = []
        for _ in range(2):  # again for a copy of an input that failed under another name
            run = partial(_answered, how=how, folder=Path.cwd() if scheduler else None)
            with closing(
                each(run, work.left(), jobs=jobs, scheduler=scheduler,
                     on_death=_dead, on_lost=lost.extend)
            ) as answered:  # fmt: skip
                for task, rows in answered:
                    work.done(task, rows)
                    progress(work.share)
        try:
            write_table(place, work.rows())
        except UserError as error:
            raise UserError(
                f"{error}; give the command again, which goes on from {beside}"
            ) from None
        parts.remove()
    return BatchResult(
        place, len(listed), work.epochs, work.before, tuple(work.reasons), tuple(lost)
    )


def _how(
    method: str,
    condition: str,
    settings: Settings | str | Path | Mapping[str, Any] | None,
    changes: Mapping[str, Any],
    reading: Mapping[str, Any],
) -> How:
    if method not in method_names():
        raise UserError(f"--method {method}: {no_such_method(method)}")
    changed_settings(Settings(), changes)
    options = replace(read_options(**reading), condition=condition)
    chosen = None if settings is None else settings_from(settings)
    extensions = {path: content_digest(path) for path in loaded()}
    return How(method, options, chosen, changes, extensions)


class _Task(NamedTuple):
    """An input that is to be estimated, its number, and the digest of its content."""

    number: int
    input: Input
    digest: str


def _answered(task: _Task, how: How, folder: Path | None) -> list[Row]:
    """Return the rows of an input; `folder` is what its path starts from, where that is not here.

    Rows name the input as it was given. What an estimate computed refers to itself, so it is
    collected here: a worker would keep some 17 MB of each recording.
    """
    rows = _rows_of(task, how, folder)
    gc.collect()
    return rows


def _rows_of(task: _Task, how: How, folder: Path | None) -> list[Row]:
    one = task.input
    if folder is None or one.path.is_absolute():
        return answer(one, task.digest, how)
    study = one.study
    if study is not None:
        read = replace(study.folder, folder=folder / study.folder.folder)
        study = replace(study, folder=read)
    rows = answer(replace(one, path=folder / one.path, study=study), task.digest, how)
    start = f"{folder}{os.sep}"
    return [
        {name: cell.replace(start, "") if isinstance(cell, str) else cell
         for name, cell in row.items()}
        for row in rows
    ]  # fmt: skip


def _dead(task: _Task) -> list[Row]:
    return refusal(
        f"{task.input.path}: the process that estimated it ended twice, such as for want of "
        "memory; split it, or use fewer jobs"
    )


def _key(digest: str, settings_digest: str, version: str, path: Path) -> str:
    """Return a name for everything that rows depend on; the suffix decides how a file is read."""
    text = f"{digest} {settings_digest} {version} {path.suffix.lower()}"
    return hashlib.sha256(text.encode()).hexdigest()


def _is_estimate(rows: Iterable[Row]) -> bool:
    return any("epoch" in row for row in rows)


def _take_over(place: Path, parts: Parts) -> None:
    """Make parts of the table that is there already; what failed is tried again."""
    if not place.exists():
        return
    for name, group in groupby(read_table(place), lambda row: row["input"]):
        rows = [*group]
        first = rows[0]
        if first["version"] == __version__ and _is_estimate(rows):
            key = _key(first["sha256"], first["settings_sha256"], first["version"], Path(name))
            for row in rows:
                for added in ("input", "sha256", "settings_sha256", "version"):
                    del row[added]
            parts.put(key, rows)


class _Work:
    """Which inputs are done, what their rows are, and how much is left."""

    def __init__(self, listed: Sequence[Input], how: How, parts: Parts) -> None:
        self._listed, self._how, self._parts = listed, how, parts
        self._digests: list[tuple[str, str]] = [("", "")] * len(listed)
        self._failed: dict[int, list[Row]] = {}
        self._again = False
        self._costs = [INPUT_BYTES + content_bytes(one.path) for one in listed]
        self._total, self._done = sum(self._costs), 0
        self.before = self.epochs = 0
        self.reasons: list[str] = []

    @property
    def share(self) -> float:
        """The share of what this run has to do that is done."""
        return self._done / self._total if self._total else 1.0

    def left(self) -> Iterator[_Task]:
        """Yield what is to be done, each content once."""
        begun: set[str] = set()
        for number, one in enumerate(self._listed):
            if self._again and (number in self._failed or self._key(number) in self._parts):
                continue
            digest = "" if one.refused else digest_or_nothing(one.path)
            self._digests[number] = digest, self._how.digest(one)
            key = self._key(number)
            if digest and (key in begun or key in self._parts) and not self._again:
                self._total -= self._costs[number]
                self.before += key not in begun
                continue
            begun.add(key)
            yield _Task(number, one, digest)
        self._again = True

    def _key(self, number: int) -> str:
        return _key(*self._digests[number], __version__, self._listed[number].path)

    def done(self, task: _Task, rows: list[Row]) -> None:
        """Take the rows of an input; those of one that failed are not kept for another run."""
        self._done += self._costs[task.number]
        if task.digest and _is_estimate(rows):
            self._parts.put(self._key(task.number), rows)
        else:
            self._failed[task.number] = rows

    def rows(self) -> Iterator[Row]:
        """Yield every row in the order of the inputs, each with where it comes from."""
        for number, one in enumerate(self._listed):
            digest, settings_digest = self._digests[number]
            about = {
                "input": str(one.path),
                "sha256": digest,
                "settings_sha256": settings_digest,
                "version": __version__,
            }
            rows = self._failed.get(number)
            for row in self._parts.rows(self._key(number)) if rows is None else rows:
                if "epoch" in row:
                    self.epochs += 1
                else:
                    self.reasons.append(row["reason"])
                yield row | about
