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
from tests.golden.rebuilt import Expected, Rebuilt, columns, read_rebuilt
from tests.golden.table import differences, read, text_of
from tests.shared_files import skip_without

from rigidimeter.core.settings import DiagnosticLevels

ANSWERS = read(Path(__file__).with_name("answers.txt"))
BUILT_ANEW = read_rebuilt()


@pytest.mark.parametrize("name", CASES)
def test_the_answers_are_what_they_were(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    if case.needs and not case.needs.exists():
        skip_without()
    found = BUILT_ANEW.unexpected(case, ANSWERS.get(name, {}), case.answers(tmp_path))
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
    assert [str(one) for one in differences({"x": JOINT}, {})] == ["- x"]
    assert len(differences({}, {"x": JOINT})) == 1


def test_a_table_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "answers.txt"
    path.write_text(text_of({"a, b": {"epoch 1 OFF": JOINT}}))
    assert differences(read(path)["a, b"], {"epoch 1 OFF": JOINT}) == []


CASE = CASES["joint: tremor 1.0 N·m, iv"]
KEPT = {
    "epochs 0": JOINT | {"stiffness_nm_rad_low": 1.73, "stiffness_nm_rad_high": 1.77},
    "epochs 0/findings missing_term": {"level": "caution", "value": 40.0},
}


class TestRoomBuiltAnew:
    """Its answers have a second tolerance; what differs beyond it is listed by name."""

    def unexpected(self, row: dict, *commands: str, **expected: str) -> list:
        said = {Expected(CASE.name, *key.split("__")): why for key, why in expected.items()}
        return Rebuilt(commands or ["estimate"], said).unexpected(CASE, KEPT, KEPT | row)

    @pytest.mark.parametrize(
        ("key", "value", "same"),
        [
            ("stiffness_nm_rad", 1.75 + 4e-4, True),  # 0.05 standard errors are 5e-4
            ("stiffness_nm_rad", 1.75 + 6e-4, False),
            ("stiffness_nm_rad_se", 0.0104, True),
            ("stiffness_nm_rad_se", 0.0106, False),
            ("stiffness_nm_rad_high", 1.7709, True),  # 5 % of half the interval
            ("stiffness_nm_rad_high", 1.7711, False),
            ("p", 0.0203, True),
            ("outcome", "excluded", False),
        ],
    )
    def test_numbers(self, key: str, value: object, same: bool) -> None:
        row = {"epochs 0": {**KEPT["epochs 0"], key: value}}
        assert (self.unexpected(row) == []) == same

    def test_findings_are_compared_by_name_and_level(self) -> None:
        finding = "epochs 0/findings missing_term"
        assert self.unexpected({finding: {"level": "caution", "value": 9.0}}) == []
        assert self.unexpected({finding: {"level": "caution", "value": 9.0}}, "design")
        note = {finding: {"level": "note", "value": 40.0}}
        assert self.unexpected(note)
        assert self.unexpected(note, missing_term__other="the term is answered") == []

    def test_what_is_expected_is_no_difference_and_must_be_so(self) -> None:
        row = {"epochs 0/findings reflex": {"level": "note"}}
        assert self.unexpected(row)
        assert self.unexpected(row, reflex__new="the joint has one") == []
        (line,) = self.unexpected({}, reflex__new="the joint has one")
        assert line.endswith("reflex new: is expected in rebuilt.toml, and is not so")

    def test_both_columns_the_largest_first(self) -> None:
        row = {"epochs 0": {**KEPT["epochs 0"], "stiffness_nm_rad": 1.752, "p": 0.03}}
        lines = list(columns(CASE, KEPT, KEPT | row))
        assert re.fullmatch(
            r"! epochs 0 +stiffness_nm_rad +1\.75 +1\.752  \+0\.2 standard errors", lines[0]
        )
        assert re.fullmatch(r"! epochs 0 +p +0\.02 +0\.03  \+50 %", lines[1])

    def test_a_list_is_read_by_case_name_and_how(self, tmp_path: Path) -> None:
        path = tmp_path / "rebuilt.toml"
        line = f"{CASE.name}: lack_of_fit gone: a reflex: answered"
        path.write_text(f'commands = ["estimate"]\nexpected = ["{line}"]\n')
        expected = Expected(CASE.name, "lack_of_fit", "gone")
        assert read_rebuilt(path) == (["estimate"], {expected: "a reflex: answered"})
        path.write_text('commands = []\nexpected = ["lack_of_fit is gone"]\n')
        with pytest.raises(ValueError, match="is no `case: what gone"):
            read_rebuilt(path)

    def test_the_list_is_of_cases_that_exist_while_a_room_is_built_anew(self) -> None:
        assert {one.case for one in BUILT_ANEW.expected} <= set(CASES)
        assert BUILT_ANEW.commands or not BUILT_ANEW.expected
