"""Records as JSON and back: the types say what is read, so that nothing in a file chooses a type.

Dataclasses and named tuples become objects by field, tuples and lists lists, mappings objects.
Numbers that are not finite are the texts ``nan``, ``inf`` and ``-inf``; an array is its kind, its
shape, and its bytes compressed by zlib in base64, so every number comes back as it was.
"""

from __future__ import annotations

import base64
import math
import types
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from rigidimeter.documents.bounds import EXPANDED_BYTES

Array = np.ndarray[Any, Any]

_KINDS = {"<f8": np.float64, "<c16": np.complex128}
_NOT_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}
_LEVEL = 1


class WrongValue(ValueError):
    """A value of a file is not of the type that is read."""


def plain_of(value: Any) -> Any:
    """Return a record as JSON has it.

    Raises
    ------
    TypeError
        If it holds something that is none of the types above.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, str | int):  # also bool
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, np.ndarray):
        return _array(value)
    if is_dataclass(value) or hasattr(value, "_fields"):
        kind: Any = type(value)
        return {name: plain_of(getattr(value, name)) for name in _hints(kind)}
    if isinstance(value, Mapping):
        return {str(name): plain_of(each) for name, each in value.items()}
    if isinstance(value, Sequence):
        return [plain_of(each) for each in value]
    raise TypeError(f"{type(value).__name__} is not written")


def _array(values: Array) -> dict[str, Any]:
    kind = next((kind for kind, dtype in _KINDS.items() if values.dtype == dtype), None)
    if kind is None:
        raise TypeError(f"an array of {values.dtype} is not written")
    data = zlib.compress(np.ascontiguousarray(values, dtype=kind).tobytes(), _LEVEL)
    text = base64.b64encode(data).decode("ascii")
    return {"kind": kind, "shape": list(values.shape), "data": text}


class Records:
    """Reads records out of one document; its arrays are bounded together.

    Parameters
    ----------
    most_bytes : int
        Of all arrays together.
    """

    def __init__(self, most_bytes: int = EXPANDED_BYTES) -> None:
        self._left_bytes = most_bytes

    def read(self, hint: Any, value: Any) -> Any:
        """Return what `plain_of` wrote of a value of this type.

        Raises
        ------
        WrongValue
            If something is not of its type.
        """
        origin, arguments = get_origin(hint), get_args(hint)
        if origin in (Union, types.UnionType):
            return self._one_of(arguments, value)
        if origin is Literal:
            return _expected(isinstance(value, str) and value in arguments, value, hint)
        if origin is tuple:
            return self._tuple(arguments, _expected(isinstance(value, list), value, hint))
        if isinstance(origin, type) and issubclass(origin, Mapping):
            members = _expected(isinstance(value, dict), value, hint).items()
            return {name: self.read(arguments[1], each) for name, each in members}
        if origin is np.ndarray:
            return self._array(value, np.dtype(get_args(arguments[1])[0]))
        if hint is float:
            return _number(value)
        if hint in (str, bool, int, type(None)):
            right = isinstance(value, hint) and not (hint is int and isinstance(value, bool))
            return _expected(right, value, hint)
        return self._record(hint, _expected(isinstance(value, dict), value, hint))

    def _one_of(self, hints: Sequence[Any], value: Any) -> Any:
        for hint in hints:
            try:
                return self.read(hint, value)
            except WrongValue:
                continue
        raise WrongValue(f"{str(value)[:40]!r} is of none of the types {hints}")

    def _tuple(self, hints: Sequence[Any], values: list[Any]) -> tuple[Any, ...]:
        if len(hints) == 2 and hints[1] is Ellipsis:
            return tuple(self.read(hints[0], each) for each in values)
        _expected(len(hints) == len(values), values, hints)
        return tuple(self.read(hint, each) for hint, each in zip(hints, values, strict=True))

    def _array(self, value: Any, dtype: np.dtype[Any]) -> Array:
        found = _expected(isinstance(value, dict), value, dtype)
        kind, text = str(found.get("kind")), str(found.get("data"))
        _expected(_KINDS.get(kind) == dtype.type, kind, dtype)
        shape: tuple[int, ...] = self.read(tuple[int, ...], found.get("shape"))
        n_bytes = math.prod(shape) * dtype.itemsize
        enough = all(size >= 0 for size in shape) and n_bytes <= self._left_bytes
        self._left_bytes -= _expected(enough, shape, dtype) and n_bytes
        try:
            data = zlib.decompressobj().decompress(
                base64.b64decode(text, validate=True), n_bytes + 1
            )
        except (ValueError, zlib.error) as error:
            raise WrongValue(f"an array cannot be read ({error})") from None
        _expected(len(data) == n_bytes, len(data), f"{n_bytes} bytes")
        return np.frombuffer(data, dtype=kind).reshape(shape)

    def _record(self, kind: type, values: Mapping[str, Any]) -> Any:
        hints = _hints(kind)
        _expected(set(values) == set(hints), sorted(values), kind)
        found = {name: self.read(hint, values[name]) for name, hint in hints.items()}
        try:
            return kind(**found)
        except (TypeError, ValueError) as error:  # a record checks itself, too
            raise WrongValue(f"{kind.__name__}: {error}") from None


def _expected(right: bool, value: Any, hint: Any) -> Any:
    if not right:
        raise WrongValue(f"{str(value)[:40]!r} is not of type {hint}")
    return value


def _number(value: Any) -> float | int:
    if isinstance(value, str) and value in _NOT_FINITE:
        return _NOT_FINITE[value]
    # A whole number stays one: it is written without a point.
    right = isinstance(value, float | int) and not isinstance(value, bool)
    number: float | int = _expected(right, value, float)
    return number


@cache
def _hints(kind: Any) -> dict[str, Any]:
    """Return the types of the fields by which a record is made."""
    hints = get_type_hints(kind)
    if is_dataclass(kind):
        return {field.name: hints[field.name] for field in fields(kind) if field.init}
    names = getattr(kind, "_fields", None)
    if names is None:
        raise TypeError(f"{kind} is no record")
    return {name: hints[name] for name in names}
