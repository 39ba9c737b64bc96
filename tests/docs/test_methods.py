"""The pages of the methods name the estimators that there are, and modules that exist."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

from rigidimeter.analysis.estimation import METHODS

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "methods.md"


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_every_estimator_is_in_the_table_and_in_the_text(method) -> None:
    page = PAGE.read_text("utf-8")
    (row,) = re.findall(rf"^\| `{method.name}` \|.*\|$", page, re.M)
    for channel in method.needs:
        assert channel in row or "of it" in row, row
    assert re.search(rf"^(- |\*\*.*)`{method.name}`", page, re.M), method.name


def test_every_module_that_the_page_names_exists() -> None:
    named = re.findall(r"`([a-z_]+(?:\.[a-z_]+)+)`", PAGE.read_text("utf-8"))
    assert len(named) > 15
    settings = {"estimation.intervals"}
    for name in set(named) - settings:
        full = name if name.startswith("rigidimeter.") else f"rigidimeter.{name}"
        if name.startswith("closedloop."):
            full = f"rigidimeter.analysis.estimation.{name}"
        assert importlib.util.find_spec(full) is not None, name
