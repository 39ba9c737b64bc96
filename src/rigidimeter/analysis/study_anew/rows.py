"""The long table: its columns, which of its rows count, and the files that hold it.

A row is a value of one measure: of an epoch, of all epochs of a condition together, of an
examiner's visit, or of a line of any table. What is compared, how, and what is concluded are
functions of these rows; nothing else has to be known of where they come from.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rigidimeter.analysis.study_anew.measures import Measure, measure_of
from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import TextTable, csv_text, in_place, read_text_table, write_text

ROWS_SCHEMA = "rigidimeter.rows/1"


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
    "bias": Field(float, "measure", "the largest that its findings allow; inf: not told"),
}
"""The columns in their order. What is not known is empty, or NaN."""

TEXT = tuple(name for name, field in FIELDS.items() if field.kind is str)
_WHO = (
    *("subject", "group", "day", "session", "block", "epoch", "rater", "unit", "condition"),
    *("outcome", "findings"),
)
_WHAT = ("value", "low", "high", "bias")
_EMPTY = {str: "", float: np.nan, bool: True}
_DTYPE = {str: "category", float: "float64", bool: "bool"}


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
        cells = pd.Series([record.get(name, empty) for record in listed], dtype=object)
        columns[name] = cells.astype(_DTYPE[field.kind])
    return pd.DataFrame(columns)


def together(parts: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Return the rows of several tables as one.

    Categories that differ would make pandas fall back to text, of ten times the size.
    """
    parts = list(parts)
    if not parts:
        return as_rows(())
    joined = {
        name: pd.Series(pd.api.types.union_categoricals([part[name] for part in parts]))
        if name in TEXT
        else pd.concat([part[name] for part in parts], ignore_index=True)
        for name in FIELDS
    }
    return pd.DataFrame(joined)


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
        return
    import pyarrow as pa
    from pyarrow import parquet

    table = pa.Table.from_pandas(rows[list(FIELDS)], preserve_index=False)
    table = table.replace_schema_metadata((table.schema.metadata or {}) | {"schema": ROWS_SCHEMA})
    with refused(path, "cannot be written"), in_place(path) as beside:
        parquet.write_table(table, beside)


def read_rows(path: Path) -> pd.DataFrame:
    """Return the table of a file that `write_rows` wrote, or one with the same columns.

    Raises
    ------
    UserError
        If it is another file.
    """
    if _ending(path) == ".csv":
        return _from_text(read_text_table(path))
    from pyarrow import ArrowInvalid, parquet

    with refused(path, "cannot be read"):
        try:
            table = parquet.read_table(path)
        except ArrowInvalid as error:
            raise UserError(f"{path}: is no Parquet file ({error})") from None
    found = (table.schema.metadata or {}).get(b"schema", b"nothing").decode()
    if found != ROWS_SCHEMA:
        raise UserError(f"{path}: its schema is {found}, where {ROWS_SCHEMA} is expected")
    return pd.DataFrame(table.to_pandas()[list(FIELDS)])


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
