"""Numbers and names as people enter them."""

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.rig.console.page import parse_integer, parse_line, parse_name, parse_number


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.5", 1.5),
        ("1,5", 1.5),
        (",5", 0.5),
        ("0,125", 0.125),
        ("-0,125", -0.125),
        (" 20 ", 20.0),
        ("−3", -3.0),
        ("1e-3", 0.001),
        ("+2.", 2.0),
        ("1.500", 1.5),
    ],
)
def test_a_decimal_comma_is_understood(text, value):
    assert parse_number(text, "x") == value


@pytest.mark.parametrize("text", ["1,500", "12,000", "-3,250"])
def test_a_comma_that_may_separate_thousands_is_refused(text):
    with pytest.raises(UserError, match=r"may be .* or .*; write it without a comma"):
        parse_number(text, "amplitude")


@pytest.mark.parametrize(
    "text", ["", "x", "1.2.3", "1,2,3", "1 000", "nan", "inf", "0x10", "1_0", "٣", "1,5e3"]
)
def test_what_is_no_number_is_refused(text):
    with pytest.raises(UserError, match="is no number"):
        parse_number(text, "amplitude")


@pytest.mark.parametrize("read", [parse_number, parse_integer])
@pytest.mark.parametrize("text", ["1e999", "-1e400", "9" * 400])
def test_what_no_number_of_the_computer_holds_is_refused(read, text):
    with pytest.raises(UserError, match="too large"):
        read(text, "amplitude")


def test_epochs_are_whole():
    assert parse_integer("4", "epochs") == 4
    with pytest.raises(UserError, match="not a whole number"):
        parse_integer("4,5", "epochs")


@pytest.mark.parametrize(
    "text", ["../x", "a/b", "a\\b", ".", "-x", "a b", "ä", "", "x" * 41, "a\0", "<b>", "a\n"]
)
def test_a_name_cannot_be_a_path_nor_markup(text):
    with pytest.raises(UserError, match="subject"):
        parse_name(text + ("" if text.strip() == text else "x/"), "subject")


def test_a_line_is_one_line():
    assert parse_line(" said ", "note") == "said"
    with pytest.raises(UserError, match="cannot be shown"):
        parse_line("a\nb", "note")
