"""Prints the chapters of a report, each with its sections: `python -m tests.docs.chapters PAGE`."""

from __future__ import annotations

import re
import sys
import textwrap
from html import unescape
from pathlib import Path

WIDTH = 100


def chapters(page: str) -> dict[str, list[str]]:
    """Return the sections of each chapter; those of the first screen under an empty title."""
    found: dict[str, list[str]] = {"": []}
    for level, title in re.findall(r"<h([23])[^>]*>(.*?)</h\1>", page, re.DOTALL):
        words = " ".join(unescape(re.sub(r"<[^>]+>", "", title)).split())
        if level == "2":
            found[words] = []
        else:
            found[list(found)[-1]].append(words)
    return found


if __name__ == "__main__":
    for title, sections in chapters(Path(sys.argv[1]).read_text("utf-8")).items():
        if title:
            text = f"{title}: {', '.join(sections)}" if sections else title
            print(textwrap.fill(text, WIDTH, subsequent_indent="  "))
