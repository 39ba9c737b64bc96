"""Tables of what can be set: every key with its unit, range and default, from the declarations."""

from __future__ import annotations

import inspect
import pkgutil
import re
from collections.abc import Iterator, Mapping
from datetime import date
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from rigidimeter.analysis.reading.channels.mapping_file import MappingToml
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import PlanToml, StudyToml
from rigidimeter.rig.devices import DRIVERS

HEAD = "| key | unit | allowed | default |\n| --- | --- | --- | --- |\n"


def settings_tables() -> str:
    """Return those of the settings."""
    return "\n".join(_tables(Settings, ""))


def study_tables() -> str:
    """Return those of `study.toml`."""
    return "\n".join(_tables(StudyToml, ""))


def plan_tables() -> str:
    """Return those of `plan.toml`."""
    return "\n".join(_tables(PlanToml, ""))


def mapping_tables() -> str:
    """Return those of a mapping file."""
    return "\n".join(_tables(MappingToml, ""))


def rig_tables() -> str:
    """Return those of the drivers, by role."""
    parts = []
    for role, drivers in DRIVERS.items():
        for name, place in drivers.items():
            settings = pkgutil.resolve_name(place).Settings
            parts += [f'### `[{role}]`, `driver = "{name}"`\n', _prose(settings), _rows(settings)]
    return "\n".join(part for part in parts if part)


def _tables(model: type[BaseModel], name: str) -> Iterator[str]:
    """Yield the table of a section and then those below it."""
    if name:
        yield f"### `{name}`\n"
        yield _prose(model)
    yield _rows(model)
    for key, field in model.model_fields.items():
        many, below = _section(field)
        if below is not None:
            inner = f"{name.strip('[]')}.{key}".lstrip(".")
            shown = {"": f"[{inner}]", "name": f"[{inner}.NAME]", "list": f"[[{inner}]]"}[many]
            yield from _tables(below, shown)


def _section(field: FieldInfo) -> tuple[str, type[BaseModel] | None]:
    """Return the section that a field holds, if any, and whether by name or as a list."""
    if _is_section(field.annotation):
        return "", field.annotation
    inner = get_args(field.annotation)
    many = {dict: "name", list: "list", tuple: "list"}.get(get_origin(field.annotation) or int, "")
    of = inner[-1] if many == "name" else inner[0] if inner else None
    return (many, of) if many and _is_section(of) else ("", None)


def _is_section(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _prose(model: type[BaseModel]) -> str:
    text = inspect.cleandoc(model.__doc__ or "").replace("``", "`").partition("\nParameters\n")
    listed = re.findall(r"^(\w[\w, ]*) : (.*)\n((?:    .*\n?)*)", text[2] + "\n", re.M)
    lines = [f"- `{names}`: {' '.join(said.split())}" for names, _, said in listed if said.strip()]
    return text[0].strip() + "\n" + ("\n" + "\n".join(lines) + "\n" if lines else "")


def _rows(model: type[BaseModel]) -> str:
    rows = [
        f"| `{key}` | {_unit(field)} | {_allowed(field)} | {_default(field)} |\n"
        for key, field in model.model_fields.items()
        if _section(field)[1] is None
    ]
    return HEAD + "".join(rows) if rows else ""


def _unit(field: FieldInfo) -> str:
    extra = field.json_schema_extra
    unit = str(extra.get("unit", "")) if isinstance(extra, Mapping) else ""
    return "–" if unit in ("", "1") else unit


def _allowed(field: FieldInfo) -> str:
    kinds = [k for k in get_args(field.annotation) if k is not type(None)] or [field.annotation]
    if get_origin(field.annotation) is Literal:
        return ", ".join(f"`{_value(k)}`" for k in kinds)
    if any(get_origin(kind) is Literal for kind in kinds):
        return ", ".join(f"`{_value(k)}`" for kind in kinds for k in get_args(kind))
    limits = {
        name: getattr(m, name)
        for m in field.metadata
        for name in ("gt", "ge", "le", "lt")
        if hasattr(m, name)
    }
    if "le" in limits:
        low = f"above {limits['gt']:g}" if "gt" in limits else f"{limits.get('ge', 0):g}"
        return f"{low} to {limits['le']:.10g}"
    if get_origin(field.annotation) in (list, tuple):
        return {str: "list of texts", int: "list of numbers", float: "list of numbers"}[kinds[0]]
    names = {bool: "true, false", str: "text", int: "whole number", float: "number", date: "day"}
    return names.get(kinds[0], "text")


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    made = field.get_default(call_default_factory=True)  # type: ignore[call-arg]
    return "–" if made in (None, "", [], {}, (), PydanticUndefined) else f"`{_value(made)}`"


def _value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(one) for one in value) + "]"
    return str(value)
