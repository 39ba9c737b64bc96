"""The long table: its columns, which of its rows count, its files, and estimates as its rows.

A row is a value of one measure: of an epoch, of all epochs of a condition together, of an
examiner's visit, or of a line of any table. What is compared, how, and what is concluded are
functions of these rows; nothing else has to be known of where they come from. One method, with J
free, is what a study concludes from; the others are rows beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy

from rigidimeter.analysis.study.measures import MEASURES, Measure, measure_of
from rigidimeter.analysis.study.study import Condition, SessionEntry
from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import TextTable, csv_text, read_text_table, replace_file, write_text
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import PARAMETERS, Analysis, Epoch, Fit, Score

ROWS_SCHEMA = "rigidimeter.rows/1"

OF_SUBJECT = {"tremor", "voluntary_torque", "active_movement", "emg_activity", "loop_bias"}
"""Checks of the subject's own torque, which touches scores too, whatever it does to a fit."""

ALIKE_IN_BOTH = ("between_samples", "varying_between_epochs")
"""Checks that make no difference: of the rig, and of a scatter that is in the test."""

_SCORES = tuple(one.name for one in MEASURES if one.origin == "scores")
_NORMAL = 1e9
"""More degrees of freedom than this are those of a normal distribution."""


class Field(NamedTuple):
    """A column: the type of its cells, their unit (that of `measure` where it is ``measure``)."""

    kind: type
    unit: str
    meaning: str


FIELDS: Mapping[str, Field] = {
    "subject": Field(str, "", "whose joint"),
    "group": Field(str, "", "of subjects, such as patients"),
    "day": Field(str, "", "as the laboratory names it; empty where days are not known"),
    "session": Field(str, "", "the recording, or the file, that the row is from"),
    "block": Field(str, "", "number of an unbroken stretch of one condition in a session"),
    "epoch": Field(str, "", "label of the epoch, or line of the table"),
    "rater": Field(str, "", "the examiner, of ratings"),
    "unit": Field(str, "", "what a bootstrap resamples; rows of one label stay together"),
    "condition": Field(str, "", "name, or code while blinded"),
    "frequency_hz": Field(float, "Hz", "of the stimulation"),
    "amplitude": Field(float, "(column amplitude_unit)", "of the stimulation"),
    "amplitude_unit": Field(str, "", "mA or V"),
    "pulse_width_us": Field(float, "µs", "of the stimulation"),
    "task": Field(str, "", "prbs or sinusoid"),
    "since_change_min": Field(float, "min", "from the change of stimulation to the epoch"),
    "scope": Field(str, "", "epoch; condition: all its epochs together; all: those of everything"),
    "method": Field(str, "", "the estimator, or examiners; empty: a value of a table"),
    "inertia": Field(str, "", "free: J fitted with B and K; fixed: J held at its median"),
    "chosen": Field(bool, "", "whether it is what the study concludes from"),
    "measure": Field(str, "", "stored name, with its unit"),
    "value": Field(float, "measure", "the estimate"),
    "se": Field(float, "measure", "standard error of the measurement"),
    "degrees": Field(float, "1", "of freedom, for which Student's t gives the interval from se"),
    "low": Field(float, "measure", "lower end of the 95 % interval of the measurement"),
    "high": Field(float, "measure", "upper end of it"),
    "outcome": Field(str, "", "included, excluded or failed"),
    "reason": Field(str, "", "why it is not included"),
    "findings": Field(str, "", "names of those at caution or worse that touch this value"),
    "bias": Field(float, "measure", "the largest that its findings allow; inf: unknown"),
}
"""The columns in their order. What is not known is empty, or NaN."""

TEXT = tuple(name for name, field in FIELDS.items() if field.kind is str)
_WHO = (
    *("subject", "group", "day", "session", "block", "epoch", "rater", "unit", "condition"),
    *("outcome", "findings"),
)
_WHAT = ("value", "se", "low", "high", "bias")
_EMPTY = {str: "", float: np.nan, bool: True}
_DTYPE: Mapping[type, str] = {float: "float64", bool: "bool"}


def as_rows(records: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Return records as rows of the table: every column there, and of its type.

    Parameters
    ----------
    records : iterable of mappings
        Cells by column; what a record lacks is empty. Outcomes are ``included`` if not given.

    Returns
    -------
    pandas.DataFrame
        With the columns of `FIELDS`: text as categories, numbers as float64.
    """
    listed = list(records)
    columns = {}
    for name, field in FIELDS.items():
        empty = {"outcome": "included", "scope": "epoch"}.get(name, _EMPTY[field.kind])
        columns[name] = pd.Series([record.get(name, empty) for record in listed], dtype=object)
    return typed(pd.DataFrame(columns))


def typed(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows whose text is plain as the table has them: columns in order, each of its type."""
    found = rows[list(FIELDS)].astype(
        {name: _DTYPE[field.kind] for name, field in FIELDS.items() if name not in TEXT}
    )
    return found.assign(**{name: _text(rows[name]) for name in TEXT})


def _text(cells: pd.Series) -> pd.Series:
    """Return text as categories; as it is where names of files are not UTF-8: pandas refuses it."""
    try:
        return cells.astype("category")
    except UnicodeEncodeError:
        return cells.astype(object)


def together(parts: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Return the rows of several tables as one.

    Categories that differ would make pandas fall back to text, of ten times the size.
    """
    parts = list(parts)
    if not parts:
        return as_rows(())
    joined = {
        name: pd.Series(pd.api.types.union_categoricals([part[name] for part in parts]))
        if all(isinstance(part[name].dtype, pd.CategoricalDtype) for part in parts)
        else pd.concat([part[name] for part in parts], ignore_index=True)
        for name in FIELDS
    }
    return pd.DataFrame(joined)


def grouped(rows: pd.DataFrame, *columns: str) -> Any:
    """Return rows by the labels in some columns: as `groupby`, which refuses names not in UTF-8."""
    codes = [pd.factorize(rows[name].to_numpy(dtype=object))[0] for name in columns]
    return rows.groupby(codes, sort=False)


def recorded(rows: pd.DataFrame, measure: str) -> pd.DataFrame:
    """Return the epochs, or ratings, of a measure that a study concludes from, whatever counts.

    Returns
    -------
    pandas.DataFrame
        In their order: who, when, the values and what became of them. Text is plain, since
        categories that do not occur would appear in every grouping.
    """
    return _scope(rows, measure, "epoch")


def counting(rows: pd.DataFrame, measure: str) -> pd.DataFrame:
    """Return those that count: the only place that knows which."""
    found = recorded(rows, measure)
    return found[found["outcome"] == "included"]


def pooled(rows: pd.DataFrame, measure: str) -> pd.DataFrame:
    """Return the estimates of a measure from all epochs of each condition together."""
    return _scope(rows, measure, "condition")


def _scope(rows: pd.DataFrame, measure: str, scope: str) -> pd.DataFrame:
    mine = rows["chosen"] & (rows["measure"] == measure) & (rows["scope"] == scope)
    return rows.loc[mine, [*_WHO, *_WHAT]].astype(dict.fromkeys(_WHO, object))


def measures_of(rows: pd.DataFrame) -> tuple[Measure, ...]:
    """Return the measures that a study concludes from, in order of appearance."""
    mine = rows[rows["chosen"] & (rows["scope"] == "epoch")].drop_duplicates("measure")
    return tuple(
        measure_of(str(name), column=method == "")
        for name, method in zip(mine["measure"], mine["method"], strict=True)
    )


def write_rows(path: Path, rows: pd.DataFrame) -> None:
    """Write the table, by the ending of its name as Parquet or as CSV.

    Raises
    ------
    UserError
        If the name has another ending, or the file cannot be written.
    """
    if _ending(path) == ".csv":
        write_text(path, csv_text(list(FIELDS), rows[list(FIELDS)].astype(object).to_numpy()))
    else:
        with refused(path, "cannot be written"):
            replace_file(path, parquet_bytes(rows))


def parquet_bytes(rows: pd.DataFrame, beside: str = "") -> bytes:
    """Return the table as a Parquet file has it, with a text that `read_with_beside` gives back."""
    import pyarrow as pa
    from pyarrow import parquet

    table = pa.Table.from_pandas(rows[list(FIELDS)], preserve_index=False)
    about = {"schema": ROWS_SCHEMA} | ({"beside": beside} if beside else {})
    sink = pa.BufferOutputStream()
    parquet.write_table(table.replace_schema_metadata((table.schema.metadata or {}) | about), sink)
    return bytes(sink.getvalue())


def read_rows(path: Path) -> pd.DataFrame:
    """Return the table of a file that `write_rows` wrote, or one with the same columns.

    Raises
    ------
    UserError
        If it is another file.
    """
    if _ending(path) == ".csv":
        return _from_text(read_text_table(path))
    return read_with_beside(path)[0]


def read_with_beside(path: Path) -> tuple[pd.DataFrame, str]:
    """Return the table of a Parquet file, and the text that was stored with it.

    Raises
    ------
    UserError
        If it is another file.
    """
    from pyarrow import ArrowInvalid, parquet

    with refused(path, "cannot be read"):
        try:
            table = parquet.read_table(path)
        except ArrowInvalid as error:
            raise UserError(f"{path}: is no Parquet file ({error})") from None
    about = table.schema.metadata or {}
    found = about.get(b"schema", b"nothing").decode()
    if found != ROWS_SCHEMA:
        raise UserError(f"{path}: its schema is {found}, where {ROWS_SCHEMA} is expected")
    return pd.DataFrame(table.to_pandas()[list(FIELDS)]), about.get(b"beside", b"").decode()


def _ending(path: Path) -> str:
    if path.suffix not in (".csv", ".parquet"):
        raise UserError(f"{path}: rows are stored as .parquet or .csv, not as {path.suffix!r}")
    return path.suffix


def _from_text(table: TextTable) -> pd.DataFrame:
    for name in ("condition", "measure", "value"):
        table.column(name, "its column")
    if unknown := [name for name in table.columns if name not in FIELDS]:
        raise UserError(
            f"{table.source}: column {unknown[0]} is unknown; the columns of rows are "
            f"{', '.join(FIELDS)}"
        )
    return as_rows(
        {name: _cell(table, name, row) for name in table.columns} for row in range(len(table.lines))
    )


def _cell(table: TextTable, name: str, row: int) -> Any:
    text = table.columns[name][row]
    kind = FIELDS[name].kind
    if kind is str:
        return text
    if kind is bool:
        if text not in ("True", "False"):
            where = f"{table.source}, line {table.lines[row]}"
            raise UserError(f"{where}: {name} is {text!r}; write True or False")
        return text == "True"
    if text == "inf":
        return np.inf
    number = table.number(name, row)
    return np.nan if number is None else number


def estimate_rows(
    analyses: Mapping[str, Analysis],
    sessions: Mapping[str, SessionEntry] | None = None,
    epochs: Sequence[Epoch] = (),
    conditions: Iterable[Condition] = (),
) -> pd.DataFrame:
    """Return the rows of all estimates.

    Parameters
    ----------
    analyses : mapping of str to Analysis
        By method; the first is what the study concludes from.
    sessions : mapping of str to SessionEntry, optional
        By source. Without them days are not known, and each epoch is resampled by itself.
    epochs : sequence of Epoch, optional
        That were analysed, for task, block and time since the change of stimulation.
    conditions : iterable of Condition, optional
        With the stimulation.

    Returns
    -------
    pandas.DataFrame
        As `as_rows`.
    """
    place = _Place(sessions, epochs, conditions)
    records: list[dict[str, Any]] = []
    for number, (method, analysis) in enumerate(analyses.items()):
        made_by = {"method": method, "chosen": number == 0}
        for inertia, fits in (("free", analysis.fits), ("fixed", analysis.fixed_inertia)):
            stage = made_by | {"inertia": inertia, "chosen": number == 0 and inertia == "free"}
            for fit in fits:
                records += _of_fit(fit, place.of(fit, "prbs") | stage)
        if number == 0:
            records += _of_scores(analysis, place, made_by)
            records += _of_pooled(analysis, place, made_by | {"inertia": "free"})
    return as_rows(records)


class _Place:
    """Who, when and in what condition: the cells that an estimate does not hold itself."""

    def __init__(
        self,
        sessions: Mapping[str, SessionEntry] | None,
        epochs: Sequence[Epoch],
        conditions: Iterable[Condition],
    ) -> None:
        self._sessions = sessions
        self._epochs = {(epoch.source, epoch.label): epoch for epoch in epochs}
        self._blocks = blocks(epochs)
        self._doses = {one.name: one.dose for one in conditions}

    def of(self, result: Fit | Score, task: str) -> dict[str, Any]:
        key = (result.source, result.epoch)
        cells: dict[str, Any] = {
            "session": result.source,
            "epoch": result.epoch,
            "block": self._blocks.get(key, ""),
            "unit": f"{result.source}/{result.epoch}",
            "task": task,
            "outcome": result.outcome.kind,
            "reason": result.outcome.reason,
        }
        epoch = self._epochs.get(key)
        if epoch is not None and epoch.since_change_min is not None:
            cells["since_change_min"] = epoch.since_change_min
        if self._sessions is not None:
            entry = self._sessions[result.source]
            cells |= {"subject": entry.subject, "group": entry.group, "day": entry.day}
            cells["unit"] = f"{entry.subject}/{entry.day}"
        return cells | self.condition(result.condition)

    def condition(self, name: str) -> dict[str, Any]:
        return {"condition": name} | self._doses.get(name, {})


def blocks(epochs: Iterable[Epoch]) -> dict[tuple[str, str], str]:
    """Return the block of each epoch, by source and label.

    A block is an unbroken stretch of one condition, counted from 1 in each source in the order of
    time.
    """

    def begins_s(epoch: Epoch) -> float:
        stamps = [channel.time_s[0] for channel in epoch.channels.values() if len(channel)]
        return float(min(stamps, default=math.inf))

    found: dict[tuple[str, str], str] = {}
    ordered = sorted(epochs, key=lambda epoch: epoch.source)
    for _, of_source in groupby(ordered, key=lambda epoch: epoch.source):
        in_time = sorted(of_source, key=begins_s)
        for number, (_, block) in enumerate(groupby(in_time, key=lambda one: one.condition), 1):
            found |= {(epoch.source, epoch.label): str(number) for epoch in block}
    return found


def _of_fit(fit: Fit, cells: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    degrees = _degrees(fit.high - fit.low, fit.se)
    findings = " ".join(one.name for one in fit.findings if one.level != "note")
    for k, parameter in enumerate(PARAMETERS):
        yield {
            **cells,
            "measure": parameter.name,
            "value": float(fit.value[k]),
            "se": float(fit.se[k]),
            "degrees": float(degrees[k]),
            "low": float(fit.low[k]),
            "high": float(fit.high[k]),
            "findings": findings,
        }


def _degrees(width: Any, se: Any) -> Any:
    """Return the degrees of freedom for which Student's t gives the intervals."""
    with np.errstate(invalid="ignore", divide="ignore"):
        degrees = scipy.special.stdtridf(0.975, width / 2.0 / se)
    return np.where(degrees > _NORMAL, np.inf, degrees)


def _of_scores(
    analysis: Analysis, place: _Place, made_by: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    own_torque = {
        (fit.source, fit.epoch): [one.name for one in fit.findings if one.name in OF_SUBJECT]
        for fit in analysis.fits
    }
    for score in analysis.scores:
        findings = " ".join(own_torque.get((score.source, score.epoch), ()))
        cells = {**place.of(score, "sinusoid"), **made_by, "findings": findings}
        for name in _SCORES:
            yield cells | {"measure": name, "value": getattr(score, name)}


def _of_pooled(
    analysis: Analysis, place: _Place, made_by: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    """Yield the fits to all epochs of each condition, and the one to all epochs.

    The latter has no condition, as recordings without a name for theirs have none: it comes last.
    """
    known = {fit.condition for fit in analysis.fits}
    for fit in analysis.pooled:
        of_one = fit.condition in known
        known.discard(fit.condition)
        cells = {
            **place.condition(fit.condition),
            **made_by,
            "scope": "condition" if of_one else "all",
            "session": fit.source,
            "epoch": fit.epoch,
            "task": "prbs",
            "outcome": fit.outcome.kind,
            "reason": fit.outcome.reason,
        }
        for row in _of_fit(fit, cells):
            yield row | {"bias": _bias(fit.findings, (row["high"] - row["low"]) / 2.0)}


def _bias(findings: Iterable[Finding], half: float) -> float:
    """Return the largest bias that findings allow, in the unit of half the interval.

    `loop_bias` is in % of half the interval of the one of J, B and K that it moves most; others do
    not say how far.
    """
    total = sum(
        one.value / 100.0 * half if one.name == "loop_bias" else math.inf
        for one in findings
        if one.level != "note" and one.name not in ALIKE_IN_BOTH
    )
    return total if math.isfinite(total) else math.inf
