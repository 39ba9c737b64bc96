"""Turn a validation error into a sentence with key, value, unit and allowed range."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from rigidimeter.core.errors import UserError

Model = TypeVar("Model", bound=BaseModel)


def validated(model: type[Model], values: Mapping[str, Any], source: str) -> Model:
    """Return a section of values.

    Raises
    ------
    UserError
        Naming the source, and each offending key with its value and what would be right.
    """
    try:
        return model.model_validate(dict(values))
    except ValidationError as error:
        told = dict.fromkeys(sentence(model, values, detail) for detail in error.errors())
        raise UserError(f"{source}: {'; '.join(told)}") from None


def sentence(root: type[BaseModel], values: Mapping[str, Any], detail: ErrorDetails) -> str:
    """Return one sentence for one error that pydantic reports about `values`."""
    where = [part for part in detail["loc"] if part != "[key]"]
    key = _dotted(where)
    owner, field = _walk(root, where)
    if detail["type"] == "extra_forbidden":
        return _unknown_key(root, values, where, owner)
    if detail["type"] == "value_error":
        text = str(detail["msg"]).removeprefix("Value error, ")
        return f"{key}: {text}" if key else text
    if detail["type"] == "missing":
        return f'{key} is missing; write {key} = "..."'
    value: Any = detail["input"]
    if isinstance(where[-1], int) and field is not None and not _models_in(field.annotation):
        # One number of a list: show all of them.
        where = where[:-1]
        key, value = _dotted(where), values
        for part in where:
            value = value[part]
    shown = repr(value) if isinstance(value, str) else _plain(value)
    if detail["type"] in ("model_type", "dict_type"):
        return f"{key} = {shown} is not allowed: it must be a table{_header(where)}"
    if field is None:
        return f"{key} = {shown}: {detail['msg']}"
    expected = _expected(field)
    as_text = f', as in {key} = "{shown}"' if expected.startswith("a text") else ""
    return f"{key} = {shown} is not allowed: it must be {expected}{as_text}"


def _header(where: Sequence[str | int]) -> str:
    """Return how a table begins, for one that is not in a list."""
    return "" if any(isinstance(part, int) for part in where) else f", as in [{_dotted(where)}]"


def _dotted(where: Sequence[str | int]) -> str:
    text = ""
    for part in where:
        text += f"[{part}]" if isinstance(part, int) else (f".{part}" if text else part)
    return text


def _plain(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "a table"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    found: list[type[BaseModel]] = []
    for inner in typing.get_args(annotation):
        found += _models_in(inner)
    return found


def _walk(
    root: type[BaseModel], where: Sequence[str | int]
) -> tuple[type[BaseModel] | None, FieldInfo | None]:
    """Follow a location to the model that owns its last key, and the field if there is one."""
    model: type[BaseModel] | None = root
    owner: type[BaseModel] | None = root
    field: FieldInfo | None = None
    for part in where:
        if model is not None and isinstance(part, str) and part in model.model_fields:
            owner, field = model, model.model_fields[part]
            inner = _models_in(field.annotation)
            model = inner[0] if inner and not _is_container(field.annotation) else None
        elif field is not None and _models_in(field.annotation) and model is None:
            model = _models_in(field.annotation)[0]  # an entry of a list or dict of tables
            owner = model
        else:
            owner, field = model or owner, None if model is not None else field
    return owner, field


def _is_container(annotation: Any) -> bool:
    return typing.get_origin(annotation) in (list, dict, tuple, types.UnionType)


def _unknown_key(
    root: type[BaseModel],
    values: Mapping[str, Any],
    where: Sequence[str | int],
    owner: type[BaseModel] | None,
) -> str:
    key, name = _dotted(where), str(where[-1])
    known = list(owner.model_fields) if owner is not None else []
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
    if not near:
        return f"{key} is not a setting"
    here = _dotted([*where[:-1], near[0]])
    return f"{key} is not a setting; the nearest is {here} (known here: {', '.join(known)})"


def _without_none(annotation: Any) -> Any:
    """Return what an optional value is where there is one."""
    if typing.get_origin(annotation) not in (types.UnionType, typing.Union):
        return annotation
    return next(inner for inner in typing.get_args(annotation) if inner is not types.NoneType)


def _expected(field: FieldInfo) -> str:
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    if "meaning" in extra:
        return str(extra["meaning"])
    unit = str(extra.get("unit", ""))
    annotation = _without_none(field.annotation)
    suffix = "" if unit in ("", "1") else f" {unit}"
    bounds = {
        name: getattr(item, name)
        for item in field.metadata
        for name in ("gt", "ge", "le", "lt", "min_length", "max_length")
        if getattr(item, name, None) is not None
    }
    if typing.get_origin(annotation) is typing.Literal:
        return "one of " + ", ".join(repr(choice) for choice in typing.get_args(annotation))
    if annotation is bool:
        return "true or false"
    if annotation is str:
        low, high = bounds.get("min_length", 0), bounds.get("max_length")
        return "a text" if high is None else f"a text of {low} to {high} letters"
    if annotation not in (int, float):
        if _is_container(annotation):
            inner = typing.get_args(annotation)
            what = "numbers" if inner and inner[-1] is float else "tables"
            return f"a non-empty list of {what}{f' in {unit}' if suffix else ''}"
        return "a table"
    whole = annotation is int
    shown = {name: f"{bound:.0f}" if whole else f"{bound:g}" for name, bound in bounds.items()}
    words = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
    limits = [f"{words[name]} {shown[name]}{suffix}" for name in words if name in shown]
    return " ".join(("a whole number" if whole else "a number", " and ".join(limits))).rstrip()
