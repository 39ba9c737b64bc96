"""The template of a risk file has a row for each hazard around the arm, and no other."""

from __future__ import annotations

import csv
import re

from tests.docs.markdown import ROOT

FILLED_BY_A_LABORATORY = re.compile(r"severity|probability|accepted|date")


def test_each_hazard_has_its_row():
    page = (ROOT / "docs" / "reference" / "hazards.md").read_text("utf-8")
    listed = dict(re.findall(r"^\| (A\d+) \| \*\*(.+?)\*\*", page, re.M))
    with (ROOT / "examples" / "risk-file.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["hazard"] for row in rows] == list(listed)
    assert [row["title"].lower() for row in rows] == [name.lower() for name in listed.values()]
    for row in rows:
        for column, text in row.items():
            if FILLED_BY_A_LABORATORY.search(column):
                assert not text, (row["hazard"], column)
        assert row["harm"], row["hazard"]
        assert row["verification"], row["hazard"]
        assert row["measure_by_design"] or row["measure_protective"], row["hazard"]
