"""The pictures of the documents have the words of the present program; no browser is needed."""

from __future__ import annotations

import json
import re

from tests.docs import blocks, pictures
from tests.docs.markdown import DOCUMENTS, ROOT
from tests.docs.pictures import unnumbered

OF_THE_PAGE = ("/operator-day/", "/plan-the-days/")
PICTURED = json.loads(pictures.PICTURED.read_text("utf-8"))


def test_every_picture_is_in_a_document() -> None:
    shown = {
        str((path.parent / target).resolve().relative_to(ROOT))
        for path in DOCUMENTS
        for target in re.findall(r"!\[[^\]]*\]\(([^)]+\.png)\)", path.read_text("utf-8"))
    }
    pictures_of_docs = (path.relative_to(ROOT) for path in (ROOT / "docs").rglob("*.png"))
    made = {str(path) for path in pictures_of_docs if path.parts[1] != "gallery"}  # `make docs`
    assert shown == made
    of_page = {path for path in made if any(folder in path for folder in OF_THE_PAGE)}
    assert set(PICTURED) == {"docs/images/report.png", *of_page}


def test_the_picture_of_the_report_has_its_present_words(ran) -> None:
    page = (ran(blocks.RUN[0])[0] / "demo-study/report/report.html").read_text("utf-8")
    now = unnumbered(page)
    assert [text for text in PICTURED["docs/images/report.png"] if text not in now] == []


def test_the_pictures_of_the_page_have_its_present_buttons_and_labels() -> None:
    package = ROOT / "src" / "rigidimeter"
    texts = [path.read_text("utf-8") for path in sorted(package.rglob("*.py"))]
    assets = package / "rig" / "console" / "page" / "assets"
    texts += [path.read_text("utf-8") for path in sorted(assets.glob("*.js"))]
    texts += [unnumbered(path.read_text("utf-8")) for path in sorted(assets.glob("*.html"))]
    now = "\n".join(texts).lower()
    for picture, words in PICTURED.items():
        if any(folder in picture for folder in OF_THE_PAGE) and not picture.endswith("report.png"):
            # Of what is put together, each piece: "Range of motion: upper end [deg]".
            pieces = {piece.strip() for text in words for piece in re.split(r"[:;#\[\]]", text)}
            assert [piece for piece in pieces if piece.lower() not in now] == [], picture
