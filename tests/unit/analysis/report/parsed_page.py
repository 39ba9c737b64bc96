"""A report's page as text and tables, and the numbers of a text."""

import math
import re
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from html.parser import HTMLParser

from rigidimeter.analysis.report import SECTIONS

VOID = {"meta", "img", "br", "link", "input", "hr"}
NUMBER = re.compile(r"(?<![\w.])[−-]?\d+(?:\.\d+)?(?:·10[⁻⁰-⁹¹²³]+)?")
SHARED = re.compile(r"\[([^]]*)\](·10[⁻⁰-⁹¹²³]+)")
LOWERED = str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789")


class ParsedPage(HTMLParser):
    """The text of a page, its elements, and the cells of every table by its caption.

    Complains when tags do not nest.
    """

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[str] = []
        self.elements: list[dict[str, str]] = []
        self.parts: list[str] = []
        self._open: list[str] = []
        self.text = ""
        self.rows: dict[str, list[list[str]]] = {}
        self.scripts: list[str] = []
        self._caption = ""
        self._inside = ""
        self._sections: list[str] = []
        self.sections: dict[str, str] = {}
        self.feed(html)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.elements.append({name: value or "" for name, value in attrs})
        if tag not in VOID:
            self._open.append(tag)
        if tag == "section":
            self._sections.append(dict(attrs)["id"] or "")
        if tag == "caption":
            self._caption, self._inside = "", "caption"
        elif tag == "tr":
            self.rows.setdefault(self._caption.strip(), []).append([])
        elif tag in ("td", "th"):
            self.rows[self._caption.strip()][-1].append("")
            self._inside = "cell"
        elif tag == "br" and self._inside == "cell":
            self.rows[self._caption.strip()][-1][-1] += " "

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag
        if tag in ("caption", "td", "th"):
            self._inside = ""
        if tag == "section":
            self._sections.pop()

    def handle_data(self, data: str) -> None:
        if self.cdata_elem == "script":
            self.scripts.append(data)
            return
        self.text += data
        self.parts.append(data)
        if self._sections:
            place = self._sections[-1]
            self.sections[place] = self.sections.get(place, "") + data
        if self._inside == "caption":
            self._caption += data
        elif self._inside == "cell":
            self.rows[self._caption.strip()][-1][-1] += data

    def of(self, name: str) -> list[str]:
        """Return the values of an attribute."""
        return [one[name] for one in self.elements if name in one]

    def table(self, caption: str) -> list[list[str]]:
        (found,) = (rows for name, rows in self.rows.items() if name.startswith(caption))
        return [[" ".join(cell.split()) for cell in row] for row in found]

    def words(self, section: str = "") -> str:
        """Return the text of the page, or of one section, with single spaces."""
        return " ".join((self.sections[section] if section else self.text).split())


def numbers(text: str) -> list[float]:
    text = SHARED.sub(lambda all_: NUMBER.sub(rf"\g<0>{all_[2]}", all_[1]), text)
    return [float(found.replace("·10", "e").translate(LOWERED)) for found in NUMBER.findall(text)]


def assert_shows(text: str, values: Sequence[float | None], digits: int) -> None:
    """Assert that the text has these numbers in this order, rounded to so many digits or more."""
    expected = [value for value in values if value is not None]
    found = numbers(text)
    assert len(found) == len(expected), (text, expected)
    for one, value in zip(found, expected, strict=True):
        size = math.floor(math.log10(abs(value))) if value else 0
        assert abs(one - value) <= 0.501 * 10.0 ** (size - digits + 1), (text, expected)


@contextmanager
def sections_without(names: Collection[str]) -> Iterator[None]:
    """Leave sections out of a page: their figures take long and have their own tests."""
    every = [*SECTIONS]
    SECTIONS[:] = [section for section in every if section.name not in names]
    try:
        yield
    finally:
        SECTIONS[:] = every
