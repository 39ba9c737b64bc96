"""What users asked is answered where the documents lead them in two clicks."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from pathlib import Path

import pytest
from tests.docs.markdown import ROOT
from tests.docs.test_documents import _anchors

DOCS = ROOT / "docs"
QUESTIONS = tomllib.loads(
    (ROOT / "tests" / "docs" / "questions.toml").read_text("utf-8")
)["question"]  # fmt: skip
ANSWERS = DOCS / "explanation" / "questions.md"


def links(page: Path) -> set[Path]:
    """Return the pages that a page leads to: by links, cards, and its list of pages."""
    text = page.read_text("utf-8")
    named = re.findall(r"\]\(([^)\s#]+\.md)(?:#[^)\s]*)?\)", text)
    named += [f"{name}.md" for name in re.findall(r"^:link: (\S+)$", text, re.M)]
    for tree in re.findall(r"^```\{toctree\}\n(.*?)^```$", text, re.DOTALL | re.M):
        named += [f"{name}.md" for name in re.findall(r"^([\w/-]+)$", tree, re.M)]
    found = {(page.parent / name).resolve() for name in named}
    return {path for path in found if path.is_file()}


def within(clicks: int) -> set[Path]:
    """Return the pages that are reached from the home page."""
    reached = {DOCS / "index.md"}
    for _ in range(clicks):
        reached |= {path for page in reached for path in links(page)}
    return reached


def test_there_are_five_questions_of_each_role() -> None:
    assert Counter(one["role"] for one in QUESTIONS) == {
        "analyst": 5, "rig owner": 5, "study planner": 5, "reviewer": 5,
    }  # fmt: skip


def test_the_home_page_leads_to_doors_and_sections() -> None:
    names = {path.relative_to(DOCS).as_posix() for path in within(1)}
    assert {"doors/recordings.md", "how-to/index.md", "reference/index.md"} <= names


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda one: one["asks"])
def test_a_question_is_answered_two_clicks_from_home(question: dict[str, str]) -> None:
    place, _, anchor = question["answer"].partition("#")
    page = ROOT / place
    assert page in within(2)
    assert anchor in _anchors(page)


def test_each_question_is_answered_on_one_page_with_a_link_to_more() -> None:
    text = " ".join(ANSWERS.read_text("utf-8").split())
    answered = re.findall(r"\*\*([^*]+\?|[^*]+\.[^*]+\?)\*\* (.*?)(?= \*\*|$)", text)
    assert [asked for asked, _ in answered] == [one["asks"] for one in QUESTIONS]
    for question, (_, answer) in zip(QUESTIONS, answered, strict=True):
        page = ROOT / question["answer"].partition("#")[0]
        linked = re.findall(r"\]\(([^)\s#]+\.md)", answer)
        assert page in {(ANSWERS.parent / name).resolve() for name in linked}, question["asks"]
