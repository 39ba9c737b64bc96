"""The program answers as it did: every J, B, K, interval, score, p, finding and exit status.

A difference is no error by itself. If the new number is right, `make golden` writes the table anew,
and the commit says which answers changed and why.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from tests.golden.cases import CASES
from tests.golden.page import PAGE, page_of
from tests.golden.table import differences, read, text_of
from tests.shared_files import skip_without

from rigidimeter.core.settings import DiagnosticLevels

ANSWERS = read(Path(__file__).with_name("answers.txt"))


@pytest.mark.parametrize("name", CASES)
def test_the_answers_are_what_they_were(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    if case.needs and not case.needs.exists():
        skip_without()
    found = differences(ANSWERS.get(name, {}), case.answers(tmp_path))
    assert not found, f"{name} (make golden writes the table anew)\n" + "\n".join(found)


def test_every_answer_has_its_input() -> None:
    assert set(ANSWERS) == set(CASES)


def test_every_finding_is_shown_by_an_input() -> None:
    rows = [what for rows in ANSWERS.values() for what in rows]
    found = {name for what in rows for name in re.findall(r"findings (\w+)", what)}
    assert found == set(DiagnosticLevels.model_fields)


def test_the_page_lists_what_the_inputs_show() -> None:
    assert PAGE.read_text(encoding="utf-8") == page_of(CASES, ANSWERS)


JOINT = {"stiffness_nm_rad": 1.75, "stiffness_nm_rad_se": 0.01, "p": 0.02, "outcome": "included"}


@pytest.mark.parametrize(
    ("key", "value", "same"),
    [
        ("stiffness_nm_rad", 1.75 + 0.9e-5, True),  # 0.001 standard errors are 1e-5
        ("stiffness_nm_rad", 1.75 + 1.2e-5, False),
        ("stiffness_nm_rad_se", 0.010009, True),
        ("stiffness_nm_rad_se", 0.01002, False),
        ("p", 0.0203, True),  # two digits of its logarithm
        ("p", 0.0207, False),
        ("outcome", "excluded", False),
    ],
)
def test_numbers_are_compared_by_their_errors(key: str, value: object, same: bool) -> None:
    assert (differences({"x": JOINT}, {"x": JOINT | {key: value}}) == []) == same


def test_the_smallest_p_are_alike_and_a_missing_row_is_a_difference() -> None:
    assert differences({"x": {"p": 1e-200}}, {"x": {"p": 1e-13}}) == []
    assert differences({"x": JOINT}, {}) == ["- x"]
    assert len(differences({}, {"x": JOINT})) == 1


def test_a_table_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "answers.txt"
    path.write_text(text_of({"a, b": {"epoch 1 OFF": JOINT}}))
    assert differences(read(path)["a, b"], {"epoch 1 OFF": JOINT}) == []
