"""The paper on the software: its form, its references and its figures."""

from __future__ import annotations

import re

import yaml
from tests.docs.markdown import ROOT
from tests.docs.paper_figures import FIGURES, FOLDER
from tests.docs.test_plain_words import banned_in, prose

TEXT = (FOLDER / "paper.md").read_text("utf-8")
BIB = (FOLDER / "paper.bib").read_text("utf-8")
_, HEAD, BODY = TEXT.split("---\n", 2)


def test_it_has_the_sections_and_the_length_of_the_journal() -> None:
    assert re.findall(r"^# (.+)$", BODY, re.M) == [
        "Summary",
        "Statement of need",
        "State of the field",
        "Functionality",
        "Limits",
        "Acknowledgements",
        "References",
    ]
    assert 250 < len(BODY.split()) < 1000
    assert not banned_in(prose(BODY))


def test_the_authors_are_those_of_the_citation() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    about = yaml.safe_load(HEAD)
    assert [one["name"] for one in about["authors"]] == [one["name"] for one in citation["authors"]]
    assert about["bibliography"] == "paper.bib"


def test_every_reference_is_cited_and_no_identifier_is_invented() -> None:
    cited = {
        key for keys in re.findall(r"\[(@[^\]]+)\]", BODY) for key in re.findall(r"@(\w+)", keys)
    }
    assert cited == set(re.findall(r"^@\w+\{(\w+),", BIB, re.M))
    assert not re.search(r"\bdoi\b|https?:", BIB, re.I)


def test_every_figure_is_drawn_and_shown() -> None:
    shown = re.findall(r"\]\(([\w-]+)\.png\)", BODY)
    assert shown == list(FIGURES)
    assert all((FOLDER / f"{name}.png").stat().st_size > 10_000 for name in shown)
