"""Python files of the user that add to the package: an estimator, a reader, a term or a check."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

from rigidimeter.core.errors import UserError

_loaded: dict[Path, None] = {}


def loaded() -> tuple[Path, ...]:
    """Return the files that were run in this process, in their order."""
    return tuple(_loaded)


def load_file(path: Path) -> None:
    """Run a file, once in each process.

    Raises
    ------
    UserError
        If there is no such file, it is not Python, or it fails.
    """
    if not path.is_file():
        raise UserError(f"--load {path}: there is no such file")
    place = path.resolve()
    if place in _loaded:
        return
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise UserError(f"--load {path}: is not a Python file; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault(path.stem, module)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise UserError(f"--load {path}: {type(error).__name__}: {error}") from error
    _loaded[place] = None
