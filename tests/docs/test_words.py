"""What is written by hand for users stays short enough to be read."""

from __future__ import annotations

import re

from tests.docs.markdown import ROOT

FOR_USERS = [
    ROOT / "README.md",
    *(
        path
        for path in sorted((ROOT / "docs").rglob("*.md"))
        if path.relative_to(ROOT / "docs").parts[0] not in ("development", "gallery")
    ),
]
MOST = 30_000


def words(text: str) -> int:
    """Count the words outside code, comments, and what a command writes between its marks."""
    text = re.sub(r"<!-- ([\w ]+): begin -->.*?<!-- \1: end -->", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"^(```|~~~).*?^\1$", "", text, flags=re.DOTALL | re.M)
    return len(re.sub(r"\]\([^)]*\)|[|#*`:-]+", " ", text).split())


def test_words_are_counted_where_somebody_wrote_them() -> None:
    assert (
        words("Two words\n```sh\na b c\n```\n<!-- measured: begin -->\nx y\n<!-- measured: end -->")
        == 2
    )
    assert words("| a | [b c](d.md) |") == 3
    assert words("One\n<!-- sh\na b\n-->\ntwo") == 2


def test_users_are_not_given_more_than_they_can_read() -> None:
    assert sum(words(path.read_text("utf-8")) for path in FOR_USERS) <= MOST
