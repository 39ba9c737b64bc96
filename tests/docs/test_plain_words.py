"""What people read is in plain words: no document, help page, message or page has a banned one."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from inspect import getdoc
from pathlib import Path

import pytest
from tests.docs.markdown import DOCUMENTS, ROOT
from tests.docs.test_documents import below, help_of

import rigidimeter

BANNED = re.compile(
    r"\b("
    r"(?:no |a |casts? |in )?doubt(?:s|ed|ful)?|gravest|hangs? on|stands? against|"
    r"stands? in its place|rests on|too sure|said|told|kept|sound|"
    r"(?:a|each|every|no|one|can only) look|with looks|looks? alike|"
    r"(?:the )?whole(?![ -](?:number|cycle|period|day)s?\b)"
    r")\b",
    re.IGNORECASE,
)
"""Words for which there is a plainer one: reported, stored, complete, caution, depends on, check.

A whole number, cycle, period or day is a count, and has no plainer name.
"""
SRC = ROOT / "src" / "rigidimeter"
ASSETS = sorted(
    path
    for pattern in ("*.html", "*.js", "paper/*.toml")
    for path in SRC.rglob(pattern)
    if "vendored" not in path.parts
)
PAGES = [path for path in DOCUMENTS if path.name != "VISION.md" and "decisions" not in path.parts]


def banned_in(text: str) -> list[str]:
    """Return the banned words of a text, each with what is around it."""
    flat = " ".join(text.split())
    return [flat[max(0, m.start() - 40) : m.end() + 30] for m in BANNED.finditer(flat)]


def prose(markdown: str) -> str:
    """Return a document without code, links and names, which are what they are."""
    return re.sub(r"`[^`\n]+`|\]\([^)\s]+\)", "`…`", markdown)


def messages(source: str) -> Iterator[str]:
    """Yield the strings of a module that are sentences: no docstrings, no names, no paths."""
    tree = ast.parse(source)
    silent = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts = [p.value if isinstance(p, ast.Constant) else "…" for p in node.values]
            silent |= {id(part) for part in node.values}
            yield "".join(str(part) for part in parts)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            if id(node) in silent or not re.search(r"\s", node.value.strip()):
                continue
            yield node.value


def words_of(path: Path) -> str:
    """Return the words of a page, a script or a table of statements, without its code."""
    text = path.read_text("utf-8")
    if path.suffix == ".js":
        text = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)
        strings = re.findall(r'"([^"\n]*)"|`([^`]*)`', text)
        return "\n".join(one for pair in strings for one in pair if " " in one)
    return re.sub(r"<[^>]*>|\{\{.*?\}\}|\{%.*?%\}|\{#.*?#\}", " ", text, flags=re.DOTALL)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("tremor casts doubt on 3 epochs", 1),
        ("an answer that is too sure, as told", 2),
        ("this page can only look", 1),
        ("write a whole number; two whole periods; it looks for a delay", 0),
        ("the whole epoch is kept", 2),
        ("a limb at rest on a support", 0),
    ],
)
def test_the_list_finds_what_it_shall(text: str, found: int) -> None:
    assert len(banned_in(text)) == found


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_documents(path: Path) -> None:
    text = path.read_text("utf-8")
    if path.name == "CHANGELOG.md":
        text = re.split(r"^## \[", text, flags=re.M)[1]
    assert not banned_in(prose(text))


def test_help_pages() -> None:
    commands: list[tuple[str, ...]] = [()]
    found = {}
    for command in commands:
        if words := banned_in(help_of(*command)):
            found[command] = words
        commands += [(*command, name) for name in below(*command)]
    assert len(commands) > 20
    assert not found


@pytest.mark.parametrize("path", ASSETS, ids=lambda path: str(path.relative_to(SRC)))
def test_pages_of_the_program(path: Path) -> None:
    assert not banned_in(words_of(path))


def test_messages() -> None:
    found = {
        str(path.relative_to(SRC)): words
        for path in sorted(SRC.rglob("*.py"))
        for text in messages(path.read_text("utf-8"))
        if (words := banned_in(prose(text)))
    }
    assert not found


@pytest.mark.parametrize("name", rigidimeter.__all__)
def test_public_docstrings(name: str) -> None:
    public = getattr(rigidimeter, name)
    documented = [public] if callable(public) else []
    if isinstance(public, type):
        members = vars(public).items()
        documented += [member for key, member in members if not key.startswith("_")]
    assert not [words for one in documented for words in banned_in(prose(getdoc(one) or ""))]
