"""The drawings are in a document, and have the words and the numbers that the code draws now."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from tests.docs import figures_of_estimates, measured, measured_figures
from tests.docs.drawings import FILES, draw
from tests.docs.markdown import DOCUMENTS, ROOT

SHOWN = 0.5
"""Points by which a mark may be elsewhere: less than can be seen of a number."""
NAMES = [str(path.relative_to(ROOT / "docs")) for path in FILES]


def words(path: Path) -> list[str]:
    """Return what is written in a drawing."""
    return re.findall(r"<(?:text|tspan)[^>]*>([^<]+)<", path.read_text("utf-8"))


def places(path: Path) -> list[float]:
    """Return where the marks and lines of a drawing are, in points."""
    drawn = re.findall(r' (?:x|y|d)="([^"]*)"', path.read_text("utf-8"))
    return [float(one) for text in drawn for one in re.findall(r"-?\d+(?:\.\d+)?", text)]


@pytest.mark.parametrize("name", NAMES)
def test_a_drawing_has_the_words_and_numbers_that_are_drawn_now(name: str, tmp_path: Path) -> None:
    path = ROOT / "docs" / name
    draw(tmp_path / "now.svg", FILES[path])
    now = tmp_path / "now.svg"
    assert words(now)
    again = "python -m tests.docs.drawings draws it anew"
    assert words(now) == words(path), again
    assert len(places(now)) == len(places(path)), again
    np.testing.assert_allclose(places(now), places(path), atol=SHOWN, err_msg=again)


def test_every_drawing_is_in_a_document_and_small() -> None:
    shown = {
        (path.parent / target).resolve()
        for path in DOCUMENTS
        for target in re.findall(r"!\[[^\]]+\]\(([^)]+\.svg)\)", path.read_text("utf-8"))
    }
    files = {one for folder in {path.parent for path in FILES} for one in folder.glob("*.svg")}
    assert shown == set(FILES) == files
    assert all(path.stat().st_size < 100_000 for path in FILES)


def test_another_number_in_a_table_moves_its_mark(tmp_path: Path, monkeypatch) -> None:
    page = (measured.DEVELOPMENT / "late-drive.md").read_text("utf-8")
    row = "| human, relaxed | torque, angle | +0.06 "
    assert row in page
    (tmp_path / "late-drive.md").write_text(page.replace(row, row.replace("0.06", "0.26")), "utf-8")
    monkeypatch.setattr(measured, "DEVELOPMENT", tmp_path)
    draw(tmp_path / "now.svg", figures_of_estimates.late_drive)
    kept = places(measured_figures.FOLDER / "late-drive.svg")
    assert not np.allclose(places(tmp_path / "now.svg"), kept, atol=SHOWN)


def test_a_table_is_folded_with_blank_lines_around_and_read_again(tmp_path: Path) -> None:
    lines = measured.folded(["| a | b |", "| --- | ---: |", "| F (1\\|x) | -1.5 |"])
    assert lines[1] == lines[-2] == ""
    page = tmp_path / "page.md"
    page.write_text("# T\n\n<!-- measured: begin -->\n<!-- measured: end -->\nby hand\n", "utf-8")
    measured.between_the_marks(page, "\n".join(lines))
    assert page.read_text("utf-8").endswith("</details>\n\n<!-- measured: end -->\nby hand\n")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(measured, "DEVELOPMENT", tmp_path)
        (table,) = measured.tables("page")
    assert (table.heading, table.columns) == ("T", ("a", "b"))
    assert table.column("a") == ["F (1\\|x)"]
    assert measured.numbers(table.column("b")[0]) == [-1.5]
