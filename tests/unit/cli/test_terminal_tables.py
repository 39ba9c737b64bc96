"""What a terminal shows: nothing is cut off, split within a number or read as a command."""

import re
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidimeter.cli.terminal_tables import Heading, Table, paragraph, show, text_lines

NUMBERS = Table(
    ("epoch", "condition", "J\n10⁻³ kg·m²", "K\nN·m/rad"),
    [
        "study/day-1",
        ("1", "OFF", "4.5571±0.0077", "−1.509±0.016"),
        "    doubt: varying_stiffness, and many other words that together do not fit on a line "
        "of eighty letters",
        ("2", "DBS at 130 Hz", "4.6843±0.0079", "1.346"),
    ],
    "<<>>",
)


def test_numbers_stand_below_each_other_and_texts_across_the_columns() -> None:
    assert text_lines([Heading("Each epoch"), NUMBERS]) == [
        "Each epoch",
        "                                    J             K",
        "  epoch  condition         10⁻³ kg·m²       N·m/rad",
        "  study/day-1",
        "  1      OFF            4.5571±0.0077  −1.509±0.016",
        "      doubt: varying_stiffness, and many other words that together do not fit on",
        "        a line of eighty letters",
        "  2      DBS at 130 Hz  4.6843±0.0079         1.346",
    ]


def test_a_column_without_an_entry_is_left_out() -> None:
    table = Table(("epoch", "condition", "R²"), [("1", "", "0.9"), ("2", "", "1.0")], "<<>")
    assert text_lines([table]) == ["  epoch   R²", "  1      0.9", "  2      1.0"]


letters = st.characters(min_codepoint=33, max_codepoint=0x2FF, exclude_categories=["Zs"])
cells = st.text(letters, min_size=1, max_size=60)


@settings(max_examples=60)
@given(rows=st.lists(st.tuples(cells, cells, st.floats()), min_size=1, max_size=4))
def test_every_letter_is_shown_and_no_number_is_split(rows) -> None:
    table = Table(("a", "b", "number"), [(one, two, f"{x:.17g}") for one, two, x in rows], "<<>")
    lines = text_lines([table])
    shown = "".join(lines).replace(" ", "")
    for _, _, number in table.rows:
        assert any(line.endswith(f" {number}") for line in lines)
    escaped = [word for row in table.rows for cell in row[:2] for word in text_lines([cell], 1000)]
    assert sorted(shown) == sorted("abnumber" + "".join([*escaped, *(r[2] for r in table.rows)]))
    assert all(len(line) <= 80 for line in lines)


def test_words_stay_whole_where_there_is_room_for_them() -> None:
    row = (
        "study/sessions/2026-01-01T10-00-00",
        "torque and velocity do not agree",
        "4.5571±0.0077",
    )
    lines = text_lines([Table(("file", "what it says", "J"), [row], "<<>")])
    assert lines[1:] == [
        "  study/sessions/2026-01-01T10-00-00  torque and velocity do not   4.5571±0.0077",
        "                                      agree",
    ]
    table = Table(("", "n", ""), [("present", "1" * 50, "misses the band")], "<><", indent=0)
    assert text_lines([table], 60)[1:] == [f"present  {'1' * 50}  misses", f"{'the band':>69}"]


def test_a_table_whose_numbers_need_more_room_is_wider_than_the_terminal() -> None:
    table = Table(("",) * 3, [("a long name of something", "1" * 30, "2" * 30)], "<>>", indent=0)
    lines = text_lines([table], 40)[1:]
    assert lines[0] == f"a long     {'1' * 30}  {'2' * 30}"
    assert [line.strip() for line in lines[1:]] == ["name of", "something"]  # no word is broken


def test_names_are_neither_markup_nor_commands() -> None:
    name = "[red]a[/red]\x1b[31m:smile:\nb"
    lines = text_lines([name, Table((name,), [(name,)], "<", indent=0), Heading(name)])
    assert "\x1b" not in "".join(lines)
    assert lines[0] == lines[-1] == "[red]a[/red]\\x1b[31m:smile:\\nb"


def test_wide_letters_take_two_places() -> None:
    table = Table(("name", "n"), [("条件", "1"), ("abcd", "2")], "<>", indent=0)
    assert text_lines([table])[1:] == ["条件  1", "abcd  2"]


@pytest.mark.parametrize("terminal", [True, False])
def test_only_a_terminal_has_bold_letters(monkeypatch, capsys, terminal) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    show([Heading("Title"), NUMBERS])
    out = capsys.readouterr().out
    assert ("\x1b[1mTitle\x1b[0m" in out) == terminal
    assert re.sub(r"\x1b\[\d*m", "", out).splitlines() == text_lines([Heading("Title"), NUMBERS])


@pytest.mark.parametrize(("given", "width"), [("20", 40), ("64", 64), ("300", 100), ("x", 80)])
def test_lines_are_as_long_as_the_terminal_within_limits(monkeypatch, capsys, given, width) -> None:
    monkeypatch.setenv("COLUMNS", given)
    show(["word " * 100])
    out = capsys.readouterr().out
    assert width - 5 <= max(map(len, out.splitlines())) <= width


def test_a_paragraph_keeps_its_indent_and_long_words() -> None:
    assert paragraph("  to " + "x" * 12, 10) == ["  to", "    " + "x" * 12]
