"""Makes the pictures of the documents, and the output that the tutorials show.

    python -m tests.docs.pictures

It needs Chromium and takes some minutes: parts of an operator's days run in real time. The words
that a picture shows are written to `pictured.json`, so that they are compared without a browser.
"""

from __future__ import annotations

import json
import re
import tempfile
from html import unescape
from pathlib import Path

from playwright.sync_api import Page
from tests.browser import open_browser
from tests.docs.blocks import RUN, run, write
from tests.docs.markdown import ROOT

REPORT = ROOT / "docs" / "images" / "report.png"
DAY = ROOT / "docs" / "tutorials" / "operator-day"
DAYS = ROOT / "docs" / "how-to" / "plan-the-days"
PICTURED = Path(__file__).with_name("pictured.json")
REPORT_SIZE = {"width": 1180, "height": 810}
_NUMBER = re.compile(r"[+−-]?\d+(?:[.,]\d+)?")
_SEEN = """selector => [...document.querySelectorAll(selector)].filter(
  one => { const box = one.getBoundingClientRect();
    return box.height && box.top >= 0 && box.bottom <= innerHeight && one.checkVisibility(); }
).map(one => one.innerText)"""
IN_REPORT = "nav a, h1, h3, caption, th, td:first-child, p.verdict, dt, dd"
ON_PAGE = "button, .q-field__label, a"


def seen(page: Page, selector: str) -> list[str]:
    """Return the words of what can be seen of some elements, each once, numbers as ``#``."""
    found = (unnumbered(text.split(" /")[0]) for text in page.evaluate(_SEEN, selector))
    return sorted({text for text in found if text})


def unnumbered(text: str) -> str:
    """Return text on one line with numbers as ``#``; tags are taken off."""
    plain = unescape(re.sub(r"<[^>]+>", " ", text))
    return " ".join(_NUMBER.sub("#", plain).split())


def main() -> None:
    """Make all."""
    from tests.console.pictures import pictures
    from tests.console.planned_pictures import planned_pictures

    words: dict[str, list[str]] = {}
    with tempfile.TemporaryDirectory(prefix="pictures-") as name:
        for path in RUN:
            folder = Path(name, path.stem)
            folder.mkdir()
            if shown := list(run(path, folder)):
                write(shown)
        page_file = Path(name, RUN[0].stem, "demo-study", "report", "report.html")
        with open_browser() as browser:
            page = browser.new_page(viewport=REPORT_SIZE)
            page.goto(page_file.as_uri())
            page.screenshot(path=REPORT)
            words[f"{REPORT.relative_to(ROOT)}"] = seen(page, IN_REPORT)
        for made, folder in ((pictures, DAY), (planned_pictures, DAYS)):
            place = Path(name, folder.name)
            place.mkdir()
            for picture, shown_words in made(folder, place).items():
                words[f"{(folder / picture).relative_to(ROOT)}.png"] = shown_words
    PICTURED.write_text(json.dumps(words, indent=1, ensure_ascii=False) + "\n", "utf-8")


if __name__ == "__main__":
    main()
