"""The tutorials show what the program prints: their commands are run, in order."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.core_install import DEMO, commands, examples
from tests.docs import blocks
from tests.unit.analysis.report.parsed_page import ParsedPage

from rigidimeter.core.files import read_json


@pytest.mark.parametrize("path", blocks.RUN, ids=lambda path: path.stem)
def test_a_tutorial_shows_what_its_commands_print(path: Path, ran) -> None:
    assert ran(path)[1] == []


def test_the_demo_shows_what_was_simulated_beside_what_was_found(ran) -> None:
    folder = ran(blocks.RUN[0])[0] / "demo-study"
    report = (folder / "report" / "report.html").read_text("utf-8")
    assert re.search(r"(\d+) of \1 epochs without a caution\.", report)
    rows = read_json(folder / "analysis" / "comparison.json")["conclusion"]
    simulated = {row["measure"]: row["simulated_difference_percent"] for row in rows}
    assert simulated["stiffness_nm_rad"] == pytest.approx(100 * (1.44 / 1.751 - 1))
    assert simulated["damping_nm_s_rad"] == pytest.approx(100 * (0.119 / 0.1368 - 1))
    assert simulated["inertia_kg_m2"] == 0.0
    page = ParsedPage(report).table("DBS against OFF")
    column = page[0].index("Simulated")
    on_page = {cells[0]: cells[column] for cells in page[1:]}
    assert on_page["K, N·m/rad"] == "−18 %"
    assert on_page["B, N·m·s/rad"] == "−13 %"
    assert on_page["J, 10⁻³ kg·m²"] == "0"


def test_the_demo_writes_what_examples_of_help_name(ran) -> None:
    folder = ran(blocks.RUN[0])[0] / "demo-study"
    named = {word for _, one in commands() for words in examples(one) for word in words}
    paths = [word.removeprefix(DEMO) for word in named if word.startswith(DEMO)]
    assert len(paths) > 5
    assert [path for path in paths if not any(folder.glob(path))] == []


@pytest.mark.parametrize(
    ("shown", "printed", "why"),
    [
        ("K 1.77 lower\nDone in 19 s", "K  1.79 lower Done in 278 s", ""),
        ("K −13.1 % (+0.5) ± 0.011", "K −13.9 % (0.0) ± 0.025", ""),
        ("K −13.1 %", "K −33.9 %", "−13.1 is printed as −33.9"),
        ("K 1.77 lower", "K 1.77 higher", "lower is printed as higher"),
        ("K 1.77 N·m", "K 2.77 N·m", "1.77 is printed as 2.77"),
        ("K 1.77", "K 1.77 N·m", "3 words are printed, 2 shown"),
        ("on 2026-11-27 by K.", "on 2027-01-02 by K.", ""),
    ],
)
def test_words_must_agree_and_numbers_nearly(shown: str, printed: str, why: str) -> None:
    found = blocks.differs(shown, printed)
    assert found.endswith(why)
    assert bool(found) == bool(why)
