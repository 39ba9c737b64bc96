"""Turn pydantic's errors into sentences with key, value and unit."""

from __future__ import annotations

import difflib
import typing
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from rigidimeter.core.errors import UserError

Model = TypeVar("Model", bound=BaseModel)


def validated(model: type[Model], values: Mapping[str, Any], source: str) -> Model:
    """Return a section of values.

    Raises
    ------
    UserError
        Naming the source, and each offending key with its value and what would be right. A
        sentence begins with its key, so what is wrong with several is placed at the first.
    """
    try:
        return model.model_validate(dict(values))
    except ValidationError as error:
        told = dict.fromkeys(_sentence(model, detail) for detail in error.errors())
        places = {one.replace(": ", ".", 1).split()[0]: one for one in told}
        raise UserError(f"{source}: {'; '.join(told)}", places=places) from None


def _sentence(root: type[BaseModel], detail: ErrorDetails) -> str:
    where = [part for part in detail["loc"] if part != "[key]"]
    key, value, text = _dotted(where), detail["input"], detail["msg"].removeprefix("Value error, ")
    table, unit = _place(root, where)
    if detail["type"] == "extra_forbidden":
        known = list(table.model_fields)
        near = difflib.get_close_matches(str(where[-1]), known, n=1, cutoff=0.0)
        if not near:  # the driver of somebody else may have no settings
            return f"{key} is not a setting"
        nearest = _dotted([*where[:-1], near[0]])
        return f"{key} is not a setting; the nearest is {nearest} (known here: {', '.join(known)})"
    if detail["type"] == "value_error":
        return f"{key}: {text}" if key else text
    if detail["type"] in ("model_type", "dict_type"):
        text = "Input should be a table" + ("" if "[" in key else f", as in [{key}]")
    shown = "a table" if isinstance(value, Mapping) else repr(value)
    given = f"{key} is missing" if detail["type"] == "missing" else f"{key} = {shown}"
    return f"{given}: {text}{unit and f', in {unit}'}"


def _dotted(where: Sequence[str | int]) -> str:
    text = ""
    for part in where:
        text += f"[{part}]" if isinstance(part, int) else (f".{part}" if text else part)
    return text


def _place(root: type[BaseModel], where: Sequence[str | int]) -> tuple[type[BaseModel], str]:
    """Return the innermost table on the way to a value, and the unit of the value."""
    table, unit = root, ""
    for part in where:
        field = table.model_fields.get(str(part))
        if field is not None:  # else a place in a list, the name of a table, or an unknown key
            extra = field.json_schema_extra
            unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
            table = _table_in(field.annotation) or table
    return table, "" if unit == "1" else unit


def _table_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_table_in, typing.get_args(annotation))), None)
