"""The pictures of the documents have the words of the present program; no browser is needed."""

from __future__ import annotations

import json
import re

from tests.docs import blocks, pictures
from tests.docs.markdown import DOCUMENTS, ROOT
from tests.docs.pictures import unnumbered

PICTURED = json.loads(pictures.PICTURED.read_text("utf-8"))


def test_every_picture_is_in_a_document_and_was_made_by_the_command() -> None:
    shown = {
        str((path.parent / target).resolve().relative_to(ROOT))
        for path in DOCUMENTS
        for target in re.findall(r"!\[[^\]]*\]\(([^)]+\.png)\)", path.read_text("utf-8"))
    }
    made = {str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.png")}
    assert shown == made == set(PICTURED)


def test_the_picture_of_the_report_has_its_present_words(ran) -> None:
    page = (ran(blocks.RUN[0])[0] / "demo-study/report/report.html").read_text("utf-8")
    now = unnumbered(page)
    assert [text for text in PICTURED["docs/images/report.png"] if text not in now] == []


def test_the_pictures_of_the_page_have_its_present_buttons_and_labels() -> None:
    sources = [path.read_text("utf-8") for path in sorted((ROOT / "src").rglob("*.py"))]
    sources += [path.read_text("utf-8") for path in (ROOT / "src").rglob("assets/*.js")]
    now = "\n".join(sources)
    for picture, words in PICTURED.items():
        if "operator-day/" in picture and not picture.endswith("report.png"):
            texts = {text.partition("#")[0].strip() for text in words}
            assert [text for text in texts if text not in now] == [], picture
