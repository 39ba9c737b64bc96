"""The pages of the methods name the estimators that there are, and modules that exist."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import re
from pathlib import Path

import pytest

from rigidimeter.analysis.estimation import METHODS

DOCS = Path(__file__).parents[2] / "docs"
PAGE = DOCS / "reference" / "methods.md"
ALGEBRA = DOCS / "explanation" / "algebra-of-estimation.md"
ARCHITECTURE = DOCS / "development" / "architecture.md"
ROOM = type(METHODS[0]).__module__.rpartition(".")[0]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.name)
def test_every_estimator_is_in_the_table_and_in_the_text(method) -> None:
    page = PAGE.read_text("utf-8")
    (row,) = re.findall(rf"^\| `{method.name}` \|.*\|$", page, re.M)
    for channel in method.needs:
        assert channel in row or "of it" in row, row
    assert re.search(rf"^(- |\*\*.*)`{method.name}`", page, re.M), method.name


@pytest.mark.parametrize(("page", "least"), [(PAGE, 15), (ALGEBRA, 10)], ids=lambda one: str(one))
def test_every_module_that_a_page_names_exists(page: Path, least: int) -> None:
    named = set(re.findall(r"`([a-z_]+(?:\.[a-z_]+)+)`", page.read_text("utf-8")))
    assert len(named) >= least
    for name in named:
        full = name if name.startswith("rigidimeter.") else f"rigidimeter.{name}"
        if name.startswith("estimation."):
            full = f"{ROOM}.{name.removeprefix('estimation.')}"
        assert importlib.util.find_spec(full) is not None, name


def test_the_architecture_says_what_every_module_of_the_room_holds() -> None:
    (part,) = re.findall(r"^## Estimation$(.*?)^## ", ARCHITECTURE.read_text("utf-8"), re.M | re.S)
    named = {name for row in re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", part, re.M)
             for name in re.findall(r"\w+", row)}  # fmt: skip
    found = pkgutil.iter_modules(importlib.import_module(ROOM).__path__)
    assert named == {one.name for one in found}
