"""The page that lists each capability and each finding with the input that shows it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from tests.golden.case import Case
from tests.golden.table import Answers

PAGE = Path(__file__).parents[2] / "docs" / "development" / "golden-answers.md"
HEAD = """\
# Golden answers

`tests/golden` runs {n} inputs through the command line and compares every J, B and K, interval,
score, p, finding, outcome and exit status with `tests/golden/answers.txt`. The table tells that an
answer has changed, not that it is right; the scenarios, references and the paper's ledger do that.

J, B, K and the ends of intervals may differ by 0.001 of their standard error, p in the third digit
of its logarithm (below 1e-12 all are alike), other numbers by 1e-4, words and counts not at all. A
difference is printed as a list of the values that changed. `make golden` writes the table and this
page anew; a commit that changes the table says which answers and why. `python -m tests.golden
--compare` prints old and new side by side, the largest difference first, and writes nothing.

A room that is built anew has other rounding and another search. What goes through commands that
`tests/golden/rebuilt.toml` names may differ by 0.05 standard errors, and errors and intervals by
5 %; findings are compared by name and level. What differs beyond that, as where the program answers
what it did not, is listed there, a line with its reason each.

## What each input shows

| capability | inputs |
| --- | --- |
"""
FINDINGS = """
## Findings

| finding | level | an input that shows it |
| --- | --- | --- |
"""


def page_of(cases: Mapping[str, Case], answers: Answers) -> str:
    """Return the page, from the inputs and their answers."""
    shown: dict[str, list[str]] = {}
    for case in cases.values():
        shown.setdefault(case.shows, []).append(case.name)
    lines = [f"| {what} | {'; '.join(names)} |" for what, names in sorted(shown.items())]
    found: dict[tuple[str, str], str] = {}
    for name, rows in answers.items():
        for what, row in rows.items():
            for finding in re.findall(r"findings (\w+)", what):
                found.setdefault((finding, str(row["level"])), name)
    findings = [f"| `{one}` | {level} | {name} |" for (one, level), name in sorted(found.items())]
    return (
        HEAD.format(n=len(cases)) + "\n".join(lines) + "\n" + FINDINGS + "\n".join(findings) + "\n"
    )
