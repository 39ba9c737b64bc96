"""The recordings of others and the numbers of R, which are read in place and never copied."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NoReturn

import pytest

SHARED = Path(os.environ.get("RIGIDIMETER_SHARED", Path(__file__).parents[2] / "shared"))


def skip_without() -> NoReturn:
    """Leave a test out, by one sentence for all of them: pytest counts these together."""
    pytest.skip(
        "the recordings of others and the numbers of R are not here; RIGIDIMETER_SHARED names "
        "their folder"
    )
