"""Names of a room that are imported when they are first used (PEP 562)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def lazy_names(room: str, modules: Mapping[str, Sequence[str]]) -> Callable[[str], Any]:
    """Return what the room takes for its `__getattr__`.

    Parameters
    ----------
    room : str
        `__name__` of the package.
    modules : mapping
        Its modules, each with the names that are taken from it.
    """
    module_of = {name: module for module, names in modules.items() for name in names}

    def found(name: str) -> Any:
        if name not in module_of:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        value = getattr(import_module(f"{room}.{module_of[name]}"), name)
        setattr(sys.modules[room], name, value)  # the next use finds it there
        return value

    return found
