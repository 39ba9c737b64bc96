"""Names that command a terminal or a spreadsheet arrive nowhere as commands."""

import csv
import json
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidimeter.analysis.figures import svg_text
from rigidimeter.analysis.report import shown_text
from rigidimeter.cli.output import echo
from rigidimeter.core.files import as_read, as_written, csv_text, read_text_table, visible

RED = "\x1b[31m=1+1"


def test_names_reach_terminal_and_table_without_commands(rigidimeter, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")  # so that no name is broken
    folder = tmp_path / "\x1b]0;title\x07"
    folder.mkdir()
    rng = np.random.default_rng(1)
    names = [RED, "=1+1", "-OFF"]
    paths = [folder / f"{number}.npz" for number in range(3)]
    for path in paths:
        angle_rad = np.cumsum(rng.standard_normal(2000)) / 500
        np.savez(path, torque_nm=rng.standard_normal(2000), angle_rad=angle_rad, fs=100.0)
    table, document = tmp_path / "e.csv", tmp_path / "e.json"
    given = [part for name in names for part in ("--condition", name)]
    ran = rigidimeter("estimate", *paths, *given, "--full", "--csv", table, "--json", document)
    for text in (ran.out, ran.err, table.read_text()):
        assert "\x1b" not in text
        assert "\x07" not in text
    assert "\\x1b[31m=1+1" in ran.out
    with table.open() as file:
        written = [row["condition"] for row in csv.DictReader(file)]
    assert written == ["\\x1b[31m=1+1", "'=1+1", "'-OFF"]
    # JSON has escapes of its own, so the names themselves are in the document.
    assert [row["condition"] for row in json.loads(document.read_text())["epochs"]] == names


def test_a_refusal_shows_a_name_without_commands(rigidimeter, tmp_path):
    ran = rigidimeter("estimate", tmp_path / "\x1b[2Ja.csv")
    assert ran.status == 1
    assert "\x1b" not in ran.err
    assert "\\x1b[2Ja.csv: there is no such file" in ran.err


def test_a_message_stays_one_line(rigidimeter, tmp_path):
    ran = rigidimeter("estimate", tmp_path / "a\nwarning: b.csv")
    assert ran.err.count("\n") == 1
    assert "a\\nwarning: b.csv: there is no such file" in ran.err


@pytest.mark.parametrize(
    "given",
    [
        ("--\x1b]0;t\x07",),
        ("\x1b]0;t\x07",),
        ("estimate", "a.csv", "--\x1b]0;t\x07"),
        ("study", "\x1b]0;t\x07"),
        ("design", "\x1b]0;t\x07"),
    ],
    ids=("option", "command", "option of a command", "command of study", "argument"),
)
def test_an_error_of_usage_shows_a_word_without_commands(rigidimeter, given):
    ran = rigidimeter(*given)
    assert ran.status == 2
    assert "Usage: " in ran.err
    assert "\x1b" not in ran.err
    assert "\x07" not in ran.err
    assert "\\x1b]0;t\\x07" in ran.err


@pytest.mark.parametrize(
    "sign", ["=", "+", "-", "@", "\t=", "\n=", "\uff1d", "\uff0b", "\uff0d", "\uff20"]
)
def test_no_cell_is_a_formula_also_in_full_width_or_after_a_line_feed(sign):
    (_, row) = csv.reader(csv_text(["name"], [[f"{sign}1+A1"]]).splitlines(keepends=True))
    assert row == [f"'{sign}1+A1"]
    assert as_read(row[0]) == f"{sign}1+A1"


@settings(max_examples=60)
@given(text=st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=8))
def test_text_of_a_table_is_read_as_it_was_written(text):
    assert as_read(as_written(text)) == text


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t=", "\r=", "'=", "''-"])
def test_a_table_that_was_written_is_read_back(tmp_path, start):
    name = f"{start}A1"
    path = tmp_path / "t.csv"
    path.write_text(csv_text(["a", "n"], [(name, -1.5), ("+3", np.float64(-2))]))
    cell = path.read_text().splitlines()[1]
    assert cell.lstrip('"')[0] in "'\\"
    table = read_text_table(path)
    assert table.columns["a"][0] == visible(name, lines=True)
    assert table.columns["n"] == ("-1.5", "-2.0")
    assert table.columns["a"][1] == "+3"


def test_pages_and_figures_hold_no_control_characters():
    assert shown_text("a\x1bb\nc") == "a\\x1bb\nc"
    figure, axes = plt.subplots()
    axes.set_title("a\x1b[31m")
    text = svg_text(figure)
    plt.close(figure)
    assert "\x1b" not in text


def test_a_message_is_broken_between_words_on_a_terminal_alone(monkeypatch, capsys):
    text = (
        "warning: " + "a long message of many words " * 8 + "/a/path/that-has-no-blank/" + 60 * "x"
    )
    echo(text, err=True)
    assert capsys.readouterr().err == f"{text}\n"
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "60")
    echo(text, err=True)
    lines = capsys.readouterr().err.splitlines()
    assert " ".join(lines) == text
    assert all(len(line) <= 60 for line in lines[:-1])
