"""The figures of the explanations are in a document, and have the words that the code draws."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.docs.drawings import DRAWINGS, FOLDER, draw
from tests.docs.markdown import DOCUMENTS


def words(path: Path) -> list[str]:
    """Return what is written in a drawing."""
    return re.findall(r"<(?:text|tspan)[^>]*>([^<]+)<", path.read_text("utf-8"))


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_drawing_has_the_words_that_are_drawn_now(name: str, tmp_path: Path) -> None:
    draw(tmp_path / "now.svg", DRAWINGS[name])
    now = words(tmp_path / "now.svg")
    assert now
    assert now == words(FOLDER / f"{name}.svg"), "python -m tests.docs.drawings draws it anew"


def test_every_drawing_is_in_a_document() -> None:
    shown = {
        (path.parent / target).resolve()
        for path in DOCUMENTS
        for target in re.findall(r"!\[[^\]]+\]\(([^)]+\.svg)\)", path.read_text("utf-8"))
    }
    assert shown == {FOLDER / f"{name}.svg" for name in DRAWINGS} == set(FOLDER.glob("*.svg"))
