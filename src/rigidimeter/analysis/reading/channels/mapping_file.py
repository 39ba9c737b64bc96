"""A mapping file: how the files of one laboratory are read, in TOML.

It says what the options of the command line say; an option comes before it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, create_model

from rigidimeter.analysis.reading.channels.choice import LABELS
from rigidimeter.analysis.reading.channels.quantities import QUANTITIES
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import toml_text
from rigidimeter.core.settings import Section, read_section

MAPPING_SCHEMA = "rigidimeter.mapping/1"


class ColumnTable(Section):
    """``[torque]`` and the like: the file's name of the column, its unit and its calibration."""

    column: str | None = Field(None, min_length=1, max_length=200)
    unit: str | None = Field(None, min_length=1, max_length=40)
    scale: str | None = Field(None, min_length=1, max_length=80)
    offset: str | None = Field(None, min_length=1, max_length=80)


class _Options(Section):
    rate_hz: float | None = Field(None, gt=0.0, json_schema_extra={"unit": "Hz"})
    reaction: bool = False
    epoch_length_s: float | None = Field(None, gt=0.0, json_schema_extra={"unit": "s"})
    task: Literal["prbs", "sinusoid"] | None = None
    skip_rows: int = Field(0, ge=0, le=1_000_000)
    names: list[str] = Field(default_factory=list, max_length=2000)
    table: str = Field("", max_length=200)
    missing: str = Field("", max_length=200)
    epoch_column: str | None = Field(None, min_length=1, max_length=200)
    condition_column: str | None = Field(None, min_length=1, max_length=200)
    task_column: str | None = Field(None, min_length=1, max_length=200)


_TABLES: Mapping[str, Any] = {one.name: (ColumnTable, ColumnTable()) for one in QUANTITIES}
MappingToml = create_model("MappingToml", __base__=_Options, **_TABLES)
"""All of a mapping file but its schema."""


def read_mapping(path: Path) -> ReadOptions:
    """Read a mapping file.

    Raises
    ------
    UserError
        Naming each offending key, its value, and what would be right.
    """
    said = read_section(path, MAPPING_SCHEMA, MappingToml)
    tables: dict[str, ColumnTable] = {one.name: getattr(said, one.name) for one in QUANTITIES}
    columns = {name: table.column for name, table in tables.items() if table.column}
    columns |= {
        label: text for label in LABELS if (text := getattr(said, f"{label}_column")) is not None
    }
    try:
        return ReadOptions(
            columns,
            said.rate_hz,
            said.reaction,
            said.epoch_length_s,
            task=said.task,
            skip_rows=said.skip_rows,
            names=tuple(said.names),
            table=said.table,
            missing=said.missing,
            units={name: table.unit for name, table in tables.items() if table.unit},
            scales={name: table.scale for name, table in tables.items() if table.scale},
            offsets={name: table.offset for name, table in tables.items() if table.offset},
        )
    except UserError as error:
        raise UserError(f"{path}: {error}") from None


def mapping_text(options: ReadOptions) -> str:
    """Return a mapping file that says the same as options."""
    said = options.said
    written: dict[str, Any] = {
        "schema": MAPPING_SCHEMA,
        "rate_hz": options.rate_hz,
        "reaction": options.reaction or None,
        "epoch_length_s": options.epoch_length_s,
        "task": options.task,
        "skip_rows": options.skip_rows or None,
        "names": options.names or None,
        "table": options.table or None,
        "missing": options.missing or None,
        **{f"{label}_column": said.columns.get(label) for label in LABELS},
    }
    for one in QUANTITIES:
        unit = said.units.get(one.standard)
        if unit is None and one.standard in said.asserted:
            unit = one.usual[0]
        given = {
            "column": said.columns.get(one.standard),
            "unit": unit,
            "scale": said.scales.get(one.standard),
            "offset": said.offsets.get(one.standard),
        }
        if any(given.values()):
            written[one.name] = {key: text for key, text in given.items() if text}
    return toml_text(written)


def merged(mapping: ReadOptions, given: ReadOptions) -> ReadOptions:
    """Return the options of a mapping with those of the user before them."""
    default = ReadOptions()
    changed: dict[str, Any] = {}
    for one in fields(ReadOptions):
        ours, theirs = getattr(given, one.name), getattr(mapping, one.name)
        if isinstance(ours, Mapping):  # of two spellings of one quantity the later counts
            changed[one.name] = {**theirs, **ours}
        elif ours == getattr(default, one.name):
            changed[one.name] = theirs
    return replace(given, **changed)
