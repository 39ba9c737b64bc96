"""Read settings from TOML and write them back; refusals are sentences."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_toml
from rigidimeter.core.settings.messages import Model, validated
from rigidimeter.core.settings.models import Settings


def parse_settings(values: Mapping[str, Any], *, source: str = "settings") -> Settings:
    """Validate a nested mapping.

    Raises
    ------
    UserError
        Naming each offending key, its value, its unit and the allowed range; for an unknown key
        the nearest known one.
    """
    return validated(Settings, values, source)


def read_section(path: Path, schema: str, model: type[Model]) -> Model:
    """Read a TOML file whose `schema` is this one.

    Raises
    ------
    UserError
        If the file cannot be read, is not TOML, is of another schema, or holds a bad value.
    """
    values = read_toml(path)
    found = values.pop("schema", None)
    if found is None:
        raise UserError(f'{path}: schema is missing; its first line must be schema = "{schema}"')
    if found != schema:
        raise UserError(f"{path}: schema is {found!r}; this version reads {schema!r}")
    return validated(model, values, str(path))


def load_settings(path: Path | None) -> Settings:
    """Read a TOML file; `None` gives the defaults.

    Raises
    ------
    UserError
        If the file cannot be read, is not TOML, or holds a bad value.
    """
    return Settings() if path is None else parse_settings(read_toml(path), source=str(path))


def dump_settings(settings: Settings) -> dict[str, Any]:
    """Return the settings as plain nested values, as the manifest stores them."""
    return settings.model_dump(mode="json")


def settings_from(
    source: Settings | Path | str | Mapping[str, Any] | None = None, **changes: Any
) -> Settings:
    """Return settings from whatever holds them, with some values changed.

    Parameters
    ----------
    source : Settings, path of a TOML file, mapping or None
        None stands for the defaults.
    **changes
        Tables with the values that differ, such as ``prbs={"clock_hz": 10.0}``.

    Raises
    ------
    UserError
        As `load_settings` and `parse_settings`.
    """
    if isinstance(source, Mapping):
        settings = parse_settings(source)
    elif isinstance(source, Settings):
        settings = source
    elif source is None or isinstance(source, (str, PathLike)):
        settings = load_settings(None if source is None else Path(source))
    else:
        raise UserError(
            "settings are a Settings object, a TOML file or a mapping, not of type "
            f"{type(source).__name__}"
        )
    return changed_settings(settings, changes) if changes else settings


def changed_settings(
    settings: Settings, changes: Mapping[str, Any], source: str = "settings"
) -> Settings:
    """Return the settings with the values of `changes` in their place, validated again.

    Raises
    ------
    UserError
        As `parse_settings`; the sentence begins with `source`.
    """
    # What was not stated and is not changed stays a default, and is not stated by this either;
    # the subjects, which are no section, are one default together.
    stated = settings.model_dump(mode="json", exclude_unset=True)
    touched = settings.model_dump(mode="json", include={"subject"}.intersection(changes))
    return parse_settings(_merged({**stated, **touched}, changes), source=source)


def _merged(values: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested values with those of `changes` in their place."""
    both = {
        key: _merged(values[key], value)
        if isinstance(value, Mapping) and isinstance(values.get(key), Mapping)
        else value
        for key, value in changes.items()
    }
    return {**values, **both}
