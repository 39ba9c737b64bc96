"""JSON Schemas of the files that are written, and of the TOML files that are read.

Those of TOML files come from their declarations. Those of documents come from one that has
everything: names and kinds of values from the document, meanings from the data dictionary.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from pydantic import BaseModel
from tests.docs.files_tables import analysis

from rigidimeter.analysis.reading import estimates_document
from rigidimeter.analysis.reading.channels.mapping_file import MappingToml
from rigidimeter.analysis.study import compare, comparison_document
from rigidimeter.core.files import meaning_of
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import PlanToml, StudyToml

TABLES = {"epochs": "estimates", "findings": "finding", "days": "test by days"}
"""Under which name the data dictionary has the rows of a key; others have their own."""

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def _estimates() -> dict[str, Any]:
    return _of_document(estimates_document(analysis()), "estimates.json")


def _comparison() -> dict[str, Any]:
    document = comparison_document(compare(analysis(), resamples=100))
    return _of_document(document, "comparison.json")


SCHEMAS: Mapping[str, Callable[[], dict[str, Any]]] = {
    "settings.json": lambda: _declared(Settings),
    "study.json": lambda: _declared(StudyToml),
    "plan.json": lambda: _declared(PlanToml),
    "mapping.json": lambda: _declared(MappingToml),
    "estimates.json": _estimates,
    "comparison.json": _comparison,
}


def schema_text(name: str) -> str:
    """Return a schema as it is written."""
    return json.dumps(SCHEMAS[name](), indent=1, ensure_ascii=False, sort_keys=True) + "\n"


def _declared(model: type[BaseModel]) -> dict[str, Any]:
    return {"$schema": DIALECT, **model.model_json_schema()}


def _of_document(document: Mapping[str, Any], table: str) -> dict[str, Any]:
    return {"$schema": DIALECT, "title": document["schema"], **_kind(document, table, "schema")}


def _kind(value: Any, table: str, *required: str) -> dict[str, Any]:
    """Return the kind of a value; what is a number or a text in one document may be null."""
    if table == "facts":  # each kind of finding has its own
        return {"type": ["object", "null"]}
    if isinstance(value, Mapping):
        inside = {
            key: {**_kind(one, TABLES.get(key, key)), **_description(key, table)}
            for key, one in value.items()
        }
        return {"type": ["object", "null"], "properties": inside, "required": list(required)}
    if isinstance(value, list | tuple):
        return {"type": ["array", "null"], **({"items": _kind(value[0], table)} if value else {})}
    if isinstance(value, bool):
        return {"type": ["boolean", "null"]}
    if isinstance(value, int | float):
        return {"type": ["number", "null"]}
    return {"type": ["string", "null"]} if isinstance(value, str) else {}


def _description(key: str, table: str) -> dict[str, str]:
    try:
        said = meaning_of(table, key)
    except KeyError:
        return {}
    return {"description": ", ".join(part for part in said if part)}
